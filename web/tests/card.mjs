// npm run card: makes public/card.png, which other sites show for a link to the page (Open Graph).
// It is the page's stage in the middle of a swing-up, with a name and a sentence over it.
import { fileURLToPath } from 'node:url';
import { ready, serve, visit } from './visit.mjs';

const SECONDS = 2.4; // of the swing-up

const STYLE = `
  header nav, #theme, #tour, aside, #charts, #explain, #learn-panel, #buttons, #hint, #badge, footer,
  #beside, #message { display: none !important }
  body { margin: 0 !important; padding: 0 !important; max-width: none !important; overflow: hidden }
  header { position: fixed; z-index: 1; inset: 0 auto 0 64px; width: 540px; flex-direction: column;
    align-items: start !important; justify-content: center; gap: 28px !important }
  h1 { font-size: 104px !important; letter-spacing: -0.03em !important }
  h1 img { display: none }
  header p { flex: none !important; font-size: 36px; line-height: 1.3; color: inherit !important }
  main, #stage-cell { display: block !important }
  #stage { position: fixed !important; inset: 0; height: auto !important; max-height: none !important;
    padding: 0 !important; border: 0 !important; border-radius: 0 !important }
  #view { position: absolute; inset: 16px 0 16px 560px; display: block !important }
  #scene-box { position: absolute !important; inset: 0 }
`;

const server = await serve();
const path = fileURLToPath(new URL('../public/card.png', import.meta.url));
const options = {
  viewport: { width: 1200, height: 630 },
  colorScheme: 'dark',
  bypassCSP: true, // only for the style
};
await visit(options, async (page) => {
  await page.goto(`${server.address}#agent=d3qn&speed=0.1`);
  await ready(page);
  await page.addStyleTag({ content: STYLE });
  await page.evaluate(async (seconds) => {
    upswing.clock.speed = 0;
    upswing.reset();
    upswing.setAgentOn(true);
    for (let k = 0; k < Math.round(200 * seconds); ++k) upswing.world.advance(); // 5 ms each
    upswing.clock.settle();
    await document.fonts.ready;
    await new Promise((resolve) => setTimeout(resolve, 500));
  }, SECONDS);
  await page.screenshot({ path });
});
await server.close();
console.log('public/card.png');
