// Amplitude spectrum: Hann window and radix-2 FFT.

/** Returns frequencies in Hz and amplitudes in the unit of the values, for evenly sampled values without their mean. */
export function spectrum(values, period_s) {
  let size = 1;
  while (2 * size <= values.length) size *= 2;
  const part = Array.from(values).slice(-size);
  const mean = part.reduce((sum, value) => sum + value, 0) / size;
  const real = new Float64Array(size), imaginary = new Float64Array(size);
  part.forEach((value, i) => { real[i] = (value - mean) * (0.5 - 0.5 * Math.cos((2 * Math.PI * i) / size)); });
  transform(real, imaginary);
  const frequencies = [], amplitudes = [];
  for (let i = 1; i <= size / 2; i++) {
    frequencies.push(i / (size * period_s));
    // Factor 4: the window's mean is 1/2, and half of the amplitude is at the negative frequency.
    amplitudes.push((4 * Math.hypot(real[i], imaginary[i])) / size);
  }
  return { frequencies, amplitudes };
}

function transform(real, imaginary) {
  const size = real.length;
  for (let i = 1, j = 0; i < size; i++) {
    let bit = size >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) {
      [real[i], real[j]] = [real[j], real[i]];
      [imaginary[i], imaginary[j]] = [imaginary[j], imaginary[i]];
    }
  }
  for (let length = 2; length <= size; length *= 2) {
    const angle = (-2 * Math.PI) / length;
    for (let start = 0; start < size; start += length) {
      for (let k = 0; k < length / 2; k++) {
        const [c, s] = [Math.cos(angle * k), Math.sin(angle * k)];
        const a = start + k, b = a + length / 2;
        const [r, i] = [real[b] * c - imaginary[b] * s, real[b] * s + imaginary[b] * c];
        [real[b], imaginary[b]] = [real[a] - r, imaginary[a] - i];
        [real[a], imaginary[a]] = [real[a] + r, imaginary[a] + i];
      }
    }
  }
}
