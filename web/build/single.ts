import { createHash } from 'node:crypto';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { build } from 'vite';
import type { Plugin, Rolldown } from 'vite';
import { mujoco } from './mujoco.ts';

/// The page as one HTML file, single.html, for `./upswing demo --file`: with scripts, styles, fonts
/// and pictures in it. The command puts WebAssembly and agents in place of <!-- files -->, as
/// page/fetch.ts reads them.

const TYPES: Record<string, string> = { svg: 'image/svg+xml', woff2: 'font/woff2' };
const POLICY = /(?<=http-equiv="Content-Security-Policy"\s+content=")[^"]*/;

const hashOf = (text: string) => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;
/// A script that no HTML parser ends too early.
const script = (code: string) =>
  code.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');

export function inline(
  output: readonly (Rolldown.OutputChunk | Rolldown.OutputAsset)[],
  pictures: string, // folder of icons and fonts
): string {
  const text = (ending: string) => {
    const found = output.filter(({ fileName }) => fileName.endsWith(ending));
    if (found.length !== 1) throw new Error(`expected one file ${ending}, got ${found.length}`);
    const [file] = found;
    return file!.type === 'chunk' ? file!.code : String(file!.source);
  };
  const main = output.find((file) => file.type === 'chunk' && file.isEntry) as Rolldown.OutputChunk;
  const workers = new Map(
    output
      .filter(({ fileName }) => /worker-[^/]*\.js$/.test(fileName))
      .map((file) => [
        file.fileName.split('/').at(-1)!,
        file.type === 'chunk' ? file.code : String(file.source),
      ]),
  );
  const data = (name: string) =>
    `data:${TYPES[name.split('.').at(-1)!]};base64,${readFileSync(join(pictures, name)).toString('base64')}`;
  const drawn = (code: string) =>
    code.replace(/(?:\.\.?)?\/((?:fonts\/)?[\w-]+\.(?:svg|woff2))/g, (_, name: string) =>
      data(name),
    );
  let places = 0;
  const start = /new Worker\([^{}]*(worker-[\w-]+\.js)[^{}]*\{type:`module`\}\)/g;
  const code = script(
    main.code.replace(start, (_, name: string) => {
      ++places;
      const source = workers.get(name);
      // Pages from a file may not start a worker that is a module.
      const blob = `new Blob([${JSON.stringify(source)}],{type:"text/javascript"})`;
      return `new Worker(URL.createObjectURL(${blob}))`;
    }),
  );
  if (places !== workers.size) throw new Error(`expected ${workers.size} workers, got ${places}`);
  const style = drawn(text('.css'));
  const sandbox = readFileSync(join(pictures, '../src/write/sandbox.html'), 'utf8');
  const [, sandboxed] = /<script>(.*?)<\/script>/s.exec(sandbox)!;
  const watch = script(readFileSync(join(pictures, 'watch.js'), 'utf8'));
  const policy =
    `default-src 'none'; script-src ${hashOf(code)} ${hashOf(watch)} ${hashOf(sandboxed!)} 'wasm-unsafe-eval'; ` +
    `style-src ${hashOf(style)}; img-src data:; font-src data:; worker-src blob: data:; ` +
    `base-uri 'none'; form-action 'none'`;
  return drawn(
    text('index.html')
      .replace(POLICY, policy)
      .replace(/<link[^>]*rel="(?:preload|modulepreload|manifest)"[^>]*>\s*/g, '')
      .replace(/<meta[^>]*"(?:og|twitter):[^>]*>\s*/g, '')
      .replace(/<a href="\.\/gallery\.html">[^<]*<\/a>\s*/, '') // a file of its own
      .replace('./fonts/OFL.txt', 'https://openfontlicense.org'),
  )
    .replace(/<link[^>]*rel="stylesheet"[^>]*>/, () => `<style>${style}</style>`)
    .replace(/<script[^>]*watch\.js[^>]*><\/script>/, () => `<script>${watch}</script>`)
    .replace(/<script type="module"[^>]*><\/script>\s*/, '')
    .replace('</body>', () => `<!-- files --><script type="module">${code}</script>\n</body>`);
}

export function single(): Plugin {
  let [root, folder] = ['', ''];
  return {
    name: 'single',
    apply: 'build',
    configResolved(config) {
      root = config.root;
      folder = resolve(root, config.build.outDir);
    },
    async closeBundle() {
      if (!existsSync(join(folder, 'index.html'))) return; // the build has failed
      const built = await build({
        configFile: false,
        root,
        base: './',
        logLevel: 'error',
        plugins: [mujoco()],
        build: {
          write: false,
          target: 'es2022',
          assetsInlineLimit: 0,
          modulePreload: false,
          rolldownOptions: { output: { codeSplitting: false } },
        },
      });
      const { output } = built as Rolldown.RolldownOutput;
      writeFileSync(join(folder, 'single.html'), inline(output, join(root, 'public')));
    },
  };
}
