import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Plugin } from 'vite';

/// The service worker sw.js, which keeps the page for visits without a network. Its version is a hash
/// of the page, so each other page has its own cache.

const PUBLIC = ['app.webmanifest', 'icon.svg', 'watch.js', 'agents/agents.json'];
const FONTS = ['bricolage-grotesque', 'hanken-grotesk'].map((name) => `fonts/${name}.woff2`);
const AGENTS = ['fast', 'd3qn'].map((name) => `agents/${name}.safetensors`); // of the first visit

export function offline(): Plugin {
  let root = '';
  return {
    name: 'offline',
    apply: 'build',
    enforce: 'post',
    configResolved(config) {
      root = config.root;
    },
    generateBundle: {
      order: 'post',
      handler(_, bundle) {
        const hash = createHash('sha256');
        for (const [name, file] of Object.entries(bundle)) {
          hash.update(name).update(file.type === 'asset' ? file.source : file.code);
        }
        const kept = [...PUBLIC, ...FONTS];
        for (const name of kept) hash.update(readFileSync(join(root, 'public', name)));
        const assets = Object.keys(bundle).filter((name) => name !== 'index.html');
        const lines = Object.entries({
          VERSION: hash.digest('hex').slice(0, 16),
          FILES: ['./', ...assets, ...kept],
          AGENTS,
        }).map(([name, value]) => `const ${name} = ${JSON.stringify(value)};\n`);
        const source = lines.join('') + readFileSync(join(root, 'build/service_worker.js'), 'utf8');
        this.emitFile({ type: 'asset', fileName: 'sw.js', source });
      },
    },
  };
}
