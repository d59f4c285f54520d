const reduced = matchMedia('(prefers-reduced-motion: reduce)');

/// Whether the visitor's system asks for reduced motion.
export function prefersStill(): boolean {
  return reduced.matches;
}
