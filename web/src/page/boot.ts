import loadMujoco from '@mujoco/mujoco';
import wasmUrl from '@mujoco/mujoco/mujoco.wasm?url';
import { BadInput } from '../safetensors';
import { Simulator } from '../simulator';
import { fetchBytes } from './fetch';

const WASM_BYTES = 4_520_000; // approximately; servers that compress do not send the length
const MAX_WASM_BYTES = 64 * 1024 * 1024;

/// Fetches MuJoCo and starts it; `onProgress` hears the share that has arrived. Throws BadInput.
export async function startSimulator(onProgress: (share: number) => void): Promise<Simulator> {
  if (typeof WebAssembly !== 'object') {
    throw new BadInput('this browser has no WebAssembly, or it is switched off; the page needs it');
  }
  const wasmBinary = await fetchBytes(wasmUrl, MAX_WASM_BYTES, (bytes) =>
    onProgress(Math.min(1, bytes / WASM_BYTES)),
  );
  return new Simulator(await loadMujoco({ wasmBinary, locateFile: () => wasmUrl }));
}
