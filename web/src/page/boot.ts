import wasmUrl from '@mujoco/mujoco/mujoco.wasm?url';
import coreUrl from '../../../build/wasm/core.wasm?url';
import { startCore } from '../core';
import { BadInput } from '../bad_input';
import { Mujoco } from '../mujoco';
import { fetchBytes } from './fetch';

const CORE_BYTES = 1_050_000; // approximately; servers that compress do not send the length
const MAX_WASM_BYTES = 64 * 1024 * 1024;

/// Fetches and starts our own core. `onProgress` gets the share that has arrived. Throws BadInput.
export async function fetchCore(onProgress: (share: number) => void): Promise<void> {
  if (typeof WebAssembly !== 'object') {
    throw new BadInput('this browser has no WebAssembly, or it is switched off; the page needs it');
  }
  const bytes = await fetchBytes(coreUrl, MAX_WASM_BYTES, (bytes) =>
    onProgress(Math.min(1, bytes / CORE_BYTES)),
  );
  await startCore(await WebAssembly.compile(bytes));
}

/// Fetches and starts MuJoCo, script and module. Throws BadInput and MuJoCo's errors.
export async function fetchMujoco(): Promise<Mujoco> {
  const [wasmBinary, { default: loadMujoco }] = await Promise.all([
    fetchBytes(wasmUrl, MAX_WASM_BYTES),
    import('@mujoco/mujoco'),
  ]);
  return new Mujoco(await loadMujoco({ wasmBinary, locateFile: () => wasmUrl }));
}
