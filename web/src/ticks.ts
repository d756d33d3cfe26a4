// Round numbers for the ticks of an axis.

export function linear_ticks(low: number, high: number, most: number): number[] {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((candidate) => candidate >= rough) ?? 10 * power;
  const ticks = [];
  for (let i = Math.ceil(low / step); i * step <= high + 1e-9 * step; ++i) ticks.push(i * step);
  return ticks;
}

export function log_ticks(low: number, high: number): number[] {
  const ticks = [];
  for (let power = Math.ceil(Math.log10(low)); 10 ** power <= high * (1 + 1e-9); ++power) ticks.push(10 ** power);
  return ticks.length > 1 ? ticks : linear_ticks(low, high, 4).filter((tick) => tick > 0);
}

export function tick_text(value: number): string {
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e5 || size < 1e-3)) return value.toExponential(1).replace(".0e", "e").replace("e+", "e");
  return String(Number(value.toPrecision(6)));
}
