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

  /** Whether a step of this burst comes at once after another one. */
  goesOn(frame, burst) {
    return this.last?.burst === `${frame} ${burst}` && Date.now() - this.last.time < BURST;
  }

  /** Put marks in place of a frame's; steps of one burst (the same `burst`, at once) are undone together. */
  replace(frame, marks, burst = null) {
    if (!burst || !this.goesOn(frame, burst)) this.note(this.pasts, frame, null);
    this.last = burst && { burst: `${frame} ${burst}`, time: Date.now() };
    this.forget(frame);
    this.frames.set(frame, marks);
  }

  /** Forget what could be done again in a frame, and in others the steps of all that it was part of. */
  forget(frame) {
    for (const { together } of this.futures.get(frame) ?? []) {
      for (const each of this.sharing(this.futures, together)) this.futures.delete(each);
    }
    this.futures.delete(frame);
  }

  /** Frames with a part of a step of all. */
  sharing(stacks, together) {
    if (!together) return [];
    return [...stacks.keys()].filter((frame) => stacks.get(frame).some((step) => step.together === together));
  }

  /** Frames whose later steps come before the next one of this frame, which was one of all. */
  before(frame, way) {
    const stacks = way === "undo" ? this.pasts : this.futures;
    const together = stacks.get(frame)?.at(-1)?.together;
    return this.sharing(stacks, together).filter((each) => stacks.get(each).at(-1).together !== together);
  }

  /** Put what `change` makes of them in place of the marks of all marked frames: one step of all. */
  replaceAll(change) {
    const together = {};
    for (const frame of this.marked()) {
      this.note(this.pasts, frame, together);
      this.forget(frame);
      this.frames.set(frame, change(this.of(frame)));
    }
    this.last = null;
  }

  /** Keep a frame's marks on one of the stacks; `together` is shared by steps that are undone together. */
  note(stacks, frame, together) {
    stacks.set(frame, [...(stacks.get(frame) ?? []), { marks: this.of(frame), together }]);
  }

  canUndo(frame) {
    return Boolean(this.pasts.get(frame)?.length);
  }

  canRedo(frame) {
    return Boolean(this.futures.get(frame)?.length);
  }

  /** Take back the last step of a frame, and of others if it was one of all; gives the name of a joint that it changed. */
  undo(frame) {
    return this.step(frame, this.pasts, this.futures);
  }

  redo(frame) {
    return this.step(frame, this.futures, this.pasts);
  }

  step(frame, from, to) {
    if (!from.get(frame)?.length) return null;
    const before = this.of(frame);
    const { together } = from.get(frame).at(-1);
    const others = together ? this.sharing(from, together) : [frame];
    for (const each of others) {
      this.note(to, each, together);
      this.frames.set(each, from.get(each).pop().marks);
    }
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
