import type { Plugin } from 'vite';

/// Writes the page's addresses on the web. UPSWING_SITE is the folder that the page is served from, so
/// that other sites can show its card; UPSWING_SOURCE is its repository, for a link in the footer.
export function addresses(env: NodeJS.ProcessEnv = process.env): Plugin {
  const quoted = (url: URL) => url.href.replaceAll('&', '&amp;').replaceAll('"', '%22');
  return {
    name: 'addresses',
    transformIndexHtml: {
      order: 'post',
      handler(html) {
        const { UPSWING_SOURCE: source } = env;
        const site = siteOf(env);
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

/// UPSWING_SITE, or else the address at which the pages of a GitHub or GitLab project appear, which
/// their builds know.
function siteOf(env: NodeJS.ProcessEnv): string | undefined {
  const [owner, name] = env.GITHUB_REPOSITORY?.split('/') ?? [];
  const github = owner && name && `https://${owner.toLowerCase()}.github.io/${name}/`;
  return env.UPSWING_SITE || env.CI_PAGES_URL || github || undefined;
}
