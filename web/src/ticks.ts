// Round numbers for the ticks of an axis.

export function linear_ticks(low: number, high: number, most: number): number[] {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((candidate) => candidate >= rough) ?? 10 * power;
  const ticks = [];
  for (let i = Math.ceil(low / step); i * step <= high + 1e-9 * step; ++i) ticks.push(i * step);
  return ticks;
}

/** The first digits of the ticks within each power of ten, from few ticks to many. */
const kDigits = [[1], [1, 3], [1, 2, 5], [1, 2, 3, 5, 7], [1, 2, 3, 4, 5, 6, 7, 8, 9]];

function ticks_with(digits: number[], low: number, high: number, every: number): number[] {
  const ticks = [];
  const last = Math.floor(Math.log10(high));
  for (let power = Math.floor(Math.log10(low)); power <= last; ++power) {
    if (power % every !== 0) continue;
    for (const digit of digits) {
      const tick = Number(`${digit}e${power}`);
      if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push(tick);
    }
  }
  return ticks;
}

/** As many ticks as fit: powers of ten, or steps within them; on a short range multiples of a round number. */
export function log_ticks(low: number, high: number, most: number): number[] {
  const choices: (number[] | undefined)[] = kDigits.map((digits) => ticks_with(digits, low, high, 1)).filter((ticks) => ticks.length <= most);
  const best = choices[choices.length - 1];
  if (best && best.length >= 3) return best;
  if (best) return linear_ticks(low, high, most).filter((tick) => tick > 0);
  const every = Math.ceil(Math.log10(high / low) / most);
  return ticks_with([1], low, high, every);
}

export function tick_text(value: number): string {
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e5 || size < 1e-3)) return value.toExponential(1).replace(".0e", "e").replace("e+", "e");
  return String(Number(value.toPrecision(6)));
}
