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

test('a build that does not know the address names none', () => {
  expect(built({})).toBe('<meta property="og:image" content="./card.png" /><footer></footer>');
});

test('the card has an absolute address on GitHub and GitLab without a setting', () => {
  for (const [env, site] of [
    [{ GITHUB_REPOSITORY: 'Some-One/upswing' }, 'https://some-one.github.io/upswing/'],
    [{ CI_PAGES_URL: 'https://a.gitlab.io/b' }, 'https://a.gitlab.io/b/'],
    [{ CI_PAGES_URL: 'https://a.gitlab.io/b', UPSWING_SITE: 'https://c.org' }, 'https://c.org/'],
  ] as const) {
    expect(built(env)).toContain(`content="${site}card.png"`);
  }
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
