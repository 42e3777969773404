// Values that this browser keeps.

/** Reads a stored object; empty if it is missing or damaged. */
export function stored(key) {
  try {
    return JSON.parse(localStorage.getItem(key)) ?? {};
  } catch {
    return {};
  }
}
