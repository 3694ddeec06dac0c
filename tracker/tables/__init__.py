"""Tables of keypoints and poses, in and out."""
