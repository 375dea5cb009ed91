/** Estimates the time left from the fraction done. */

/** Weight of a new measurement in the exponential moving average of the speed, which varies between stages. */
const SMOOTHING = 0.25;
/** Fraction done below which no time is estimated, because the speed varies too much at first. */
const MIN_DONE_SHARE = 0.04;
/** Duration after the start during which the time left is not estimated, ms. */
const MIN_ELAPSED_MS = 250;

export interface Eta {
  /** Records a fraction done, 0 to 1. Returns the time left in ms, or undefined before the first estimate. */
  update(share: number, now: number): number | undefined;
}

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
      if (speed === undefined || share < MIN_DONE_SHARE || now - start < MIN_ELAPSED_MS) return undefined;
      return Math.max(0, (1 - share) / speed - (now - lastTime));
    },
  };
}
