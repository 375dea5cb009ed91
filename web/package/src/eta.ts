/** How long it will still take, from the share done so far. */

/** Share of each new estimate; stages differ in speed, so that old speed must be forgotten, but not at every step. */
const SMOOTHING = 0.25;
/** No estimate before this share: the first steps say little. */
const FIRST_SHARE = 0.04;
/** Nor before this time, ms. */
const FIRST_MS = 250;

export interface Eta {
  /** Hears of a share of 0 to 1 at a time; returns the time left in ms, or undefined while nobody can know. */
  update(share: number, now: number): number | undefined;
}

/** An estimate that starts at `start`, ms. */
export function createEta(start: number): Eta {
  let lastShare = 0;
  let lastTime = start;
  let speed: number | undefined;
  return {
    update(share, now) {
      const gained = share - lastShare;
      const took = now - lastTime;
      if (gained > 0 && took > 0) {
        const current = gained / took;
        speed = speed === undefined ? current : speed + SMOOTHING * (current - speed);
        lastShare = share;
        lastTime = now;
      }
      if (speed === undefined || share < FIRST_SHARE || now - start < FIRST_MS) return undefined;
      return Math.max(0, (1 - share) / speed - (now - lastTime));
    },
  };
}
