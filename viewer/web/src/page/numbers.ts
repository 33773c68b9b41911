// Numbers in words, as short as they can be read.

/** A number of at most four digits. */
export function readable(number: number | null | undefined): string {
  if (number === null || number === undefined) return '';
  const size = Math.abs(number);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return scientific(number, 1);
  return String(Number(number.toPrecision(4)));
}

/** As 1.5e40, with so many digits after the point. */
export function scientific(number: number, digits: number): string {
  return number.toExponential(digits).replace('e+', 'e');
}

/** A length (m) of two digits, in the unit that suits it. */
export function readableLength(metres: number): string {
  const digits = (value: number) => String(Number(value.toPrecision(2)));
  if (metres < 1e-5) return `${digits(1e6 * metres)} µm`;
  return metres < 1 ? `${digits(1e3 * metres)} mm` : `${digits(metres)} m`;
}

/** Digits after the point (3 to 9) that say how far times (s) lie apart. */
export function timeDigits(spacing: number): number {
  for (let digits = 3; digits < 9; digits++) {
    if (Math.abs(Number(spacing.toFixed(digits)) - spacing) <= 0.05 * spacing) return digits;
  }
  return 9;
}
