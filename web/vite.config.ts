import { defineConfig } from 'vitest/config';
import { addresses } from './build/addresses.ts';
import { mujoco } from './build/mujoco.ts';
import { offline } from './build/offline.ts';
import { single } from './build/single.ts';
import { whitespace } from './build/whitespace.ts';

export default defineConfig({
  base: './', // served from any folder
  plugins: [mujoco(), addresses(), whitespace(), offline(), single()],
  server: { fs: { allow: ['..'] } }, // build/wasm/core.wasm
  optimizeDeps: { exclude: ['@mujoco/mujoco'] },
  build: {
    outDir: '../build/web',
    emptyOutDir: true,
    target: 'es2022',
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
  },
  test: {
    include: ['src/**/*.test.ts', 'build/**/*.test.ts'],
    environment: 'node',
    setupFiles: ['tests/core.ts'],
    isolate: false, // the core is compiled once; no test changes what another one imports
    testTimeout: 1_200_000, // ms: no test asks how fast, and a machine may be busy
  },
});
