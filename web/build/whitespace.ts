import type { Plugin } from 'vite';

/// The text without indentation and empty lines. The page has no text whose spaces count.
export const withoutIndentation = (html: string) => html.replace(/\n\s+/g, '\n');

/// Drops the indentation of the page, which is a tenth of its compressed size.
export const whitespace = (): Plugin => ({
  name: 'whitespace',
  apply: 'build',
  transformIndexHtml: { order: 'post', handler: withoutIndentation },
});
