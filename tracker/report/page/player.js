// The clips under one slider: what they show is a frame, never a time between two.

class Player {
  // `told` is called with every frame that is shown.
  constructor(videos, times, told) {
    this.videos = videos;
    this.times = times;
    this.told = told;
    this.frame = 0;
    this.playing = false;
    for (const video of videos) {
      video.addEventListener("ended", () => this.pause(this.times.length - 1));
      video.addEventListener("loadedmetadata", () => this.seek(video));
    }
  }

  // The middle of a frame: half a step in, rounding cannot fall into its neighbour.
  middle(frame) {
    const last = this.times.length - 1;
    const step = last === 0 ? 0 : frame < last
      ? this.times[frame + 1] - this.times[frame] : this.times[last] - this.times[last - 1];
    return this.times[frame] + step / 2;
  }

  seek(video) {
    video.currentTime = this.middle(this.frame);
  }

  show(frame) {
    this.frame = Math.min(Math.max(frame, 0), this.times.length - 1);
    this.videos.forEach((video) => this.seek(video));
    this.told(this.frame);
  }

  async play() {
    if (this.videos.length === 0) return;
    // Half a frame before its end, not every browser takes a clip for ended and starts it anew.
    if (this.frame === this.times.length - 1) this.show(0);
    this.playing = true;
    this.told(this.frame);
    await Promise.all(this.videos.map((video) => video.play())).catch(() => this.pause());
    if (this.playing) this.follow();
  }

  // At a frame, the one in sight unless told.
  pause(frame = this.frame) {
    if (!this.playing) return;
    this.playing = false;
    for (const video of this.videos) video.pause();
    this.show(frame);
  }

  // The first clip leads; those that have fallen behind it or run ahead are set to its time.
  follow() {
    const [lead, ...others] = this.videos;
    const tick = (_, shown) => {
      if (!this.playing) return;
      this.frame = this.at(shown ? shown.mediaTime : lead.currentTime);
      for (const other of others) {
        if (Math.abs(other.currentTime - lead.currentTime) > 0.1) other.currentTime = lead.currentTime;
      }
      this.told(this.frame);
      next();
    };
    const next = () => lead.requestVideoFrameCallback ? lead.requestVideoFrameCallback(tick) : requestAnimationFrame(tick);
    next();
  }

  // The frame in sight at a time.
  at(seconds) {
    const after = this.times.findIndex((time) => time > seconds + 1e-3);
    return after < 0 ? this.times.length - 1 : Math.max(after - 1, 0);
  }

  pace(rate) {
    for (const video of this.videos) video.playbackRate = rate;
  }
}
