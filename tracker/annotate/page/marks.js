/* The marks of every frame, what was done to them, and what the file holds of them. */
const BURST = 1000; // ms between steps that are undone together

class Marks {
  /** @param byFrame {frame: {joint: {x, y, visible}}}, as the file has them. */
  constructor(byFrame) {
    this.frames = new Map(Object.entries(byFrame).map(([frame, of]) => [Number(frame), of]));
    this.stored = new Map(this.frames);
    this.done = []; // steps, each with the marks of its frames before and after it
    this.undone = [];
    this.last = null;
  }

  of(frame) {
    return this.frames.get(frame) ?? {};
  }

  marked() {
    const some = (frame) => Object.keys(this.of(frame)).length > 0;
    return [...this.frames.keys()].filter(some).sort((a, b) => a - b);
  }

  /** Whether a step of this burst comes at once after another one. */
  goesOn(frame, burst) {
    return this.last?.burst === `${frame} ${burst}` && Date.now() - this.last.time < BURST;
  }

  /** Put marks in place of a frame's; steps of one burst (the same `burst`, at once) are undone together. */
  replace(frame, marks, burst = null) {
    const begun = burst && this.goesOn(frame, burst) ? this.done.pop().before : new Map([[frame, this.of(frame)]]);
    this.step(begun, new Map([[frame, marks]]));
    this.last = burst && { burst: `${frame} ${burst}`, time: Date.now() };
  }

  /** Put what `change` makes of them in place of the marks of all marked frames: one step of all. */
  replaceAll(change) {
    const before = new Map(this.marked().map((frame) => [frame, this.of(frame)]));
    this.step(before, new Map([...before].map(([frame, marks]) => [frame, change(marks)])));
    this.last = null;
  }

  /** Do a step; one that was undone in its frames cannot be done again, nor one that came after it in others. */
  step(before, after) {
    const changed = new Set(after.keys());
    const again = this.undone.reverse().filter((step) => {
      const stays = [...step.after.keys()].every((frame) => !changed.has(frame));
      if (!stays) step.after.forEach((_, frame) => changed.add(frame));
      return stays;
    });
    this.undone = again.reverse();
    this.done.push({ before, after });
    this.put(after);
  }

  put(marks) {
    marks.forEach((of, frame) => this.frames.set(frame, of));
  }

  /** The step of a frame that is undone, or done again, next. */
  next(frame, way) {
    return (way === "undo" ? this.done : this.undone).findLast((step) => step.after.has(frame));
  }

  /** Frames whose later steps come before the next one of this frame, which was one of all. */
  before(frame, way) {
    const step = this.next(frame, way);
    return [...(step?.after.keys() ?? [])].filter((each) => this.next(each, way) !== step);
  }

  /** Take back the next step of a frame, with all its frames, or do it again; gives the name of a joint that it changed. */
  go(frame, way) {
    const step = this.next(frame, way);
    if (!step) return null;
    const [from, to] = way === "undo" ? [this.done, this.undone] : [this.undone, this.done];
    from.splice(from.indexOf(step), 1);
    to.push(step);
    const before = this.of(frame);
    this.put(way === "undo" ? step.before : step.after);
    this.last = null;
    const after = this.of(frame);
    const names = Object.keys({ ...before, ...after });
    return names.find((name) => !Marks.same(before[name], after[name])) ?? null;
  }

  /** Frames whose marks the file has otherwise, with all their marks. */
  changed() {
    const frames = new Set([...this.frames.keys(), ...this.stored.keys()]);
    const differ = [...frames].filter((frame) => {
      const [now, then] = [this.of(frame), this.stored.get(frame) ?? {}];
      return Object.keys({ ...now, ...then }).some((name) => !Marks.same(now[name], then[name]));
    });
    return Object.fromEntries(differ.map((frame) => [frame, this.of(frame)]));
  }

  keep(sent) {
    for (const [frame, marks] of Object.entries(sent)) this.stored.set(Number(frame), marks);
  }

  static same(one, other) {
    return one?.x === other?.x && one?.y === other?.y && one?.visible === other?.visible;
  }
}
