// npm run pictures: pictures of the page for docs/ and the README.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { ready, serve, visit } from './visit.mjs';

const server = await serve();
const docs = fileURLToPath(new URL('../../docs/figures/', import.meta.url));

/// Stops time without the look of a paused page.
async function stop() {
  upswing.clock.speed = 0;
  await new Promise((resolve) => setTimeout(resolve, 500));
}

/// The tour's first step: the agent swings up from hanging, stopped on the way.
async function swingUp(page) {
  await page.goto(`${server.address}#tour=1`);
  await ready(page);
  await page.waitForFunction(() => {
    const { q1, q2 } = upswing.world.state;
    return Math.cos(q1) < 0.1 && Math.cos(q1 + q2) < -0.3;
  });
  await page.evaluate(stop);
}

await visit({ viewport: { width: 1400, height: 860 } }, async (page) => {
  await swingUp(page);
  await page.screenshot({ path: `${docs}page.png` });
});
console.log('docs/figures/page.png');

/// The README's film: the agent swings up, is shoved twice, and recovers. 25 frames a second.
await visit({ viewport: { width: 1200, height: 760 }, colorScheme: 'dark' }, async (page) => {
  const folder = mkdtempSync(join(tmpdir(), 'upswing-film-'));
  await page.goto(`${server.address}#tour=4`);
  await ready(page);
  await page.evaluate(stop);
  await page.evaluate(() => {
    for (const found of document.querySelectorAll('header, #badge')) found.style.opacity = '0';
  });
  for (let frame = 0; frame < 220; ++frame) {
    await page.evaluate(async (frame) => {
      if (frame === 85) upswing.world.shoveTo(1);
      if (frame === 145) upswing.world.shoveTo(-1);
      for (let k = 0; k < 8; ++k) upswing.world.advance(); // 5 ms each
      upswing.clock.settle();
      await new Promise(requestAnimationFrame);
      await new Promise(requestAnimationFrame);
    }, frame);
    const clip = { x: 32, y: 16, width: 728, height: 728 }; // the stage without the words
    await page.screenshot({ path: join(folder, `${String(frame).padStart(3, '0')}.png`), clip });
  }
  const palette =
    'scale=420:-1:flags=lanczos,split[a][b];[a]palettegen=max_colors=160[p];[b][p]paletteuse=dither=none';
  const frames = ['-framerate', '25', '-i', join(folder, '%03d.png')];
  execFileSync('ffmpeg', ['-y', '-v', 'error', ...frames, '-vf', palette, `${docs}recovery.gif`]);
  rmSync(folder, { recursive: true });
});
console.log('docs/figures/recovery.gif');
await server.close();
