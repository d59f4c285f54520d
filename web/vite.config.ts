import { defineConfig } from 'vite';
import { mujoco } from './build/mujoco';

export default defineConfig({
  base: './', // served from any folder
  plugins: [mujoco()],
  optimizeDeps: { exclude: ['@mujoco/mujoco'] },
  build: {
    outDir: '../build/web',
    emptyOutDir: true,
    target: 'es2022',
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
  },
});
