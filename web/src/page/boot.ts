import loadMujoco from '@mujoco/mujoco';
import wasmUrl from '@mujoco/mujoco/mujoco.wasm?url';
import coreUrl from '../../wasm/core.wasm?url';
import { startCore } from '../core';
import { BadInput } from '../bad_input';
import { Simulator } from '../simulator';
import { fetchBytes } from './fetch';

const WASM_BYTES = 4_520_000; // approximately; servers that compress do not send the length
const MAX_WASM_BYTES = 64 * 1024 * 1024;

/// Fetches our own core, which the rest of the page computes with.
async function fetchCore(): Promise<void> {
  const bytes = await fetchBytes(coreUrl, MAX_WASM_BYTES);
  await startCore(await WebAssembly.compile(bytes));
}

/// Fetches MuJoCo and our core and starts them; `onProgress` hears the share of MuJoCo that has
/// arrived. Throws BadInput.
export async function startSimulator(onProgress: (share: number) => void): Promise<Simulator> {
  if (typeof WebAssembly !== 'object') {
    throw new BadInput('this browser has no WebAssembly, or it is switched off; the page needs it');
  }
  const fetchMujoco = fetchBytes(wasmUrl, MAX_WASM_BYTES, (bytes) =>
    onProgress(Math.min(1, bytes / WASM_BYTES)),
  );
  const [wasmBinary] = await Promise.all([fetchMujoco, fetchCore()]);
  return new Simulator(await loadMujoco({ wasmBinary, locateFile: () => wasmUrl }));
}
