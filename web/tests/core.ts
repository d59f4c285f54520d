import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { startCore } from '../src/core';

/// The core for all unit tests.

export function coreModule(): Promise<WebAssembly.Module> {
  const path = fileURLToPath(new URL('../../build/wasm/core.wasm', import.meta.url));
  return WebAssembly.compile(readFileSync(path));
}

await startCore(await coreModule());
