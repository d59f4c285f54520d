import type { Plugin } from 'vite';

/// Where the page and its source are on the web, which only who publishes it knows: UPSWING_SITE, the
/// folder that the page is served from, so that others can show its card; and UPSWING_SOURCE, its
/// repository, for a link in the footer.
export function addresses(env: NodeJS.ProcessEnv = process.env): Plugin {
  const quoted = (url: URL) => url.href.replaceAll('&', '&amp;').replaceAll('"', '%22');
  return {
    name: 'addresses',
    transformIndexHtml: {
      order: 'post',
      handler(html) {
        const { UPSWING_SITE: site, UPSWING_SOURCE: source } = env;
        let made = html;
        if (site) {
          const card = quoted(new URL('card.png', site.replace(/\/*$/, '/')));
          made = made.replace(/(?<=content=")[^"]*card\.png(?=")/g, card);
        }
        if (source) {
          made = made.replace(
            '<span>Source</span>',
            `<a href="${quoted(new URL(source))}">Source</a>`,
          );
        }
        return made.replace('<span>Source</span>', '');
      },
    },
  };
}
