// What the browser keeps for this page.

/**
 * `localStorage` or `sessionStorage`, by its name; where the browser blocks it, what is kept in
 * its place until the page is closed.
 */
export function store(name) {
  try {
    if (window[name]) return window[name];
  } catch {
    // Blocked: it must not be asked for at all.
  }
  const kept = new Map();
  return {
    getItem: (key) => kept.get(key) ?? null,
    setItem: (key, value) => kept.set(key, value),
    removeItem: (key) => kept.delete(key),
  };
}
