/* The marks of every frame, what was done to them, and what the file holds of them. */
const BURST = 1000; // ms between steps that are undone together

class Marks {
  /** @param byFrame {frame: {joint: {x, y, visible}}}, as the file has them. */
  constructor(byFrame) {
    this.frames = new Map(Object.entries(byFrame).map(([frame, of]) => [Number(frame), of]));
    this.stored = new Map(this.frames);
    this.pasts = new Map();
    this.futures = new Map();
    this.last = null;
  }

  of(frame) {
    return this.frames.get(frame) ?? {};
  }

  marked() {
    const some = (frame) => Object.keys(this.of(frame)).length > 0;
    return [...this.frames.keys()].filter(some).sort((a, b) => a - b);
  }

  /** Put marks in place of a frame's; steps of one burst (the same `burst`, at once) are undone together. */
  replace(frame, marks, burst = null) {
    const step = burst && { burst: `${frame} ${burst}`, time: Date.now() };
    const goesOn = step?.burst === this.last?.burst && step?.time - this.last?.time < BURST;
    if (!goesOn) this.pasts.set(frame, [...(this.pasts.get(frame) ?? []), this.of(frame)]);
    this.last = step;
    this.futures.delete(frame);
    this.frames.set(frame, marks);
  }

  canUndo(frame) {
    return Boolean(this.pasts.get(frame)?.length);
  }

  canRedo(frame) {
    return Boolean(this.futures.get(frame)?.length);
  }

  /** Take back the last step of a frame; gives the name of a joint that it changed. */
  undo(frame) {
    return this.step(frame, this.pasts, this.futures);
  }

  redo(frame) {
    return this.step(frame, this.futures, this.pasts);
  }

  step(frame, from, to) {
    const stack = from.get(frame);
    if (!stack?.length) return null;
    const before = this.of(frame);
    const after = stack.pop();
    to.set(frame, [...(to.get(frame) ?? []), before]);
    this.frames.set(frame, after);
    this.last = null;
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
