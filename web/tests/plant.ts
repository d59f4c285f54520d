import type { Plant } from '../src/pendulum';

/// A plant that differs from the nominal one in every value.
export const OTHER: Plant = {
  size: 1,
  mass1: 1.3,
  mass2: 0.7,
  length1: 0.45,
  length2: 0.62,
  damping1: 0.1,
  damping2: 0.3,
  gravity: 8.1,
  torque_limit: 4,
};
