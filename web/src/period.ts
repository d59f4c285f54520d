/// Time between two actions by default, s; see Policy.period. A module of its own, because the worker
/// that learns needs nothing else of pendulum.ts.
export const CONTROL_PERIOD = 0.02;
