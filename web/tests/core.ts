import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { startCore } from '../src/core';

/// What every test of the page's parts computes with.

export function coreModule(): Promise<WebAssembly.Module> {
  const path = fileURLToPath(new URL('../wasm/core.wasm', import.meta.url));
  return WebAssembly.compile(readFileSync(path));
}

await startCore(await coreModule());
