import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

/// What `upswing ARGUMENTS` prints: the C++ program is what the page is tested against. UPSWING names
/// the built program.
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

/// Where an agent's policy that the page comes with lies.
export function policyPath(id: string): string {
  return fileURLToPath(new URL(`../public/agents/${id}.safetensors`, import.meta.url));
}

export function readPolicy(id: string): ArrayBuffer {
  return new Uint8Array(readFileSync(policyPath(id))).buffer;
}

/// The files of the untrained actor policies that `upswing export --test-vectors` has.
export function actorFiles(): ArrayBuffer[] {
  const { actors } = JSON.parse(runProgram('export', '--test-vectors', '-')) as {
    actors: { file: string }[];
  };
  return actors.map(({ file }) => new Uint8Array(Buffer.from(file, 'hex')).buffer);
}
