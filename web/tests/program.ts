import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

/// Output of `upswing ARGUMENTS`, the C++ program to compare the page with. UPSWING: path of the
/// built program.
export function runProgram(...args: string[]): string {
  const launcher = fileURLToPath(new URL('../../upswing', import.meta.url));
  const [program, first] = process.env.UPSWING
    ? [process.env.UPSWING, []]
    : [launcher, ['--no-setup']];
  return execFileSync(program, [...first, ...args], {
    encoding: 'utf8',
    maxBuffer: 64 << 20,
    stdio: ['ignore', 'pipe', 'pipe'],
  });
}

/// The rows of `upswing simulate ARGUMENTS`: [t, q1, q2, w1, w2, torque].
export function simulate(...args: string[]): number[][] {
  const rows = runProgram('simulate', ...args)
    .trim()
    .split('\n')
    .slice(1);
  return rows.map((row) => row.split(',').slice(0, 6).map(Number));
}

/// Path of a shipped agent's policy.
export function policyPath(id: string): string {
  return fileURLToPath(new URL(`../public/agents/${id}.safetensors`, import.meta.url));
}

export function readPolicy(id: string): ArrayBuffer {
  return new Uint8Array(readFileSync(policyPath(id))).buffer;
}

/// Untrained actor policies: a Gaussian with a critic that takes its action, one without a critic, a clipped
/// one, a categorical one.
export const ACTORS = ['squashed', 'squashed-tanh', 'clipped', 'categorical'].map((name) =>
  fileURLToPath(new URL(`actors/${name}.safetensors`, import.meta.url)),
);

export function actorFiles(): ArrayBuffer[] {
  return ACTORS.map((path) => new Uint8Array(readFileSync(path)).buffer);
}
