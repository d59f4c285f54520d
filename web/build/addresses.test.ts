import { expect, test } from 'vitest';
import { addresses } from './addresses';

const PAGE =
  '<meta property="og:image" content="./card.png" /><footer><span>Source</span></footer>';

function built(env: Record<string, string>): string {
  const { transformIndexHtml } = addresses(env) as never as {
    transformIndexHtml: { handler: (html: string) => string };
  };
  return transformIndexHtml.handler(PAGE);
}

test('a page of which nobody says where it is names no address', () => {
  expect(built({})).toBe('<meta property="og:image" content="./card.png" /><footer></footer>');
});

test('the card has a whole address, and the footer a link, where they are known', () => {
  const env = {
    UPSWING_SITE: 'https://example.org/upswing',
    UPSWING_SOURCE: 'https://example.org/a"b',
  };
  expect(built(env)).toBe(
    '<meta property="og:image" content="https://example.org/upswing/card.png" />' +
      '<footer><a href="https://example.org/a%22b">Source</a></footer>',
  );
});
