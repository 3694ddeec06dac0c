// The clips under one slider: they show a frame, never a time between two.

class Player {
  // `start` is when the clips show the first frame. `told` is called with every requested or played frame, `seen`
  // with the number of a clip and the frame that it shows: -1 before the first one, their number after the last.
  constructor(videos, times, start, { told, seen }) {
    Object.assign(this, { videos, times, start, told, seen, frame: 0, playing: false });
    const steps = times.slice(1).map((time, t) => time - times[t]);
    // Seconds by which a clip's times are rounded; a long film has more steps than a function takes arguments.
    this.slack = steps.reduce((least, step) => Math.min(least, step / 4), 1e-3);
    this.end = times.at(-1) + (steps.at(-1) ?? Infinity);
    videos.forEach((video, i) => this.watch(video, i));
  }

  watch(video, i) {
    video.addEventListener("loadedmetadata", () => this.seek(video));
    video.addEventListener("ended", () => this.pause(this.times.length - 1));
    // Not every browser has a callback for each picture, and those that have one may skip pictures.
    // At its very end a clip shows its last picture.
    video.addEventListener("seeked", () => {
      if (!this.playing) this.seen(i, this.at(Math.min(video.currentTime, video.duration - 2 * this.slack)));
    });
    const next = () => video.requestVideoFrameCallback ? video.requestVideoFrameCallback(tick) : requestAnimationFrame(tick);
    const tick = (_, shown) => {
      if (shown || this.playing) this.look(i, this.at(shown ? shown.mediaTime : video.currentTime));
      next();
    };
    next();
  }

  // The first clip leads; clips behind or ahead of it are set to its time.
  look(i, frame) {
    this.seen(i, frame);
    const [lead, ...others] = this.videos;
    if (!this.playing || i > 0 || lead.seeking) return;
    for (const other of others) {
      if (Math.abs(other.currentTime - lead.currentTime) > 0.1) other.currentTime = lead.currentTime;
    }
    if (frame >= this.times.length) {
      this.pause(this.times.length - 1);
      return;
    }
    this.frame = Math.max(frame, 0);
    this.told(this.frame);
  }

  // The middle of a frame, so that rounding cannot reach its neighbour.
  middle(frame) {
    if (this.times.length === 1) return this.times[0];
    return (this.times[frame] + (this.times[frame + 1] ?? this.end)) / 2;
  }

  seek(video) {
    video.currentTime = this.start + this.middle(this.frame);
  }

  show(frame) {
    this.frame = Math.min(Math.max(frame, 0), this.times.length - 1);
    this.videos.forEach((video, i) => {
      this.seek(video);
      if (!video.videoWidth) this.seen(i, this.frame); // no film, or none yet
    });
    this.told(this.frame);
  }

  async play() {
    // Not every browser treats a clip half a frame before its end as ended and restarts it.
    if (this.frame === this.times.length - 1) this.show(0);
    this.playing = true;
    this.told(this.frame);
    await Promise.all(this.videos.map((video) => video.play())).catch(() => this.pause());
  }

  // Go to a frame, by default the current one.
  pause(frame = this.frame) {
    if (!this.playing) return;
    this.playing = false;
    for (const video of this.videos) video.pause();
    this.show(frame);
  }

  // The frame shown at a time of the clips.
  at(seconds) {
    const now = seconds - this.start + this.slack;
    return now >= this.end ? this.times.length : this.times.findLastIndex((time) => time <= now);
  }

  pace(rate) {
    for (const video of this.videos) video.playbackRate = rate;
  }
}
