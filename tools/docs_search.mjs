// docs_search.mjs FOLDER QUERY...: prints the first hits of the documentation's search in the site
// FOLDER, as its search page shows them. One line for each query: its hits, separated by tabs.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { createContext, runInContext } from "node:vm";

const [folder, ...queries] = process.argv.slice(2);
const HITS = 5;

const context = createContext({
  DOCUMENTATION_OPTIONS: {},
  SPHINX_HIGHLIGHT_ENABLED: false,
  _ready: () => {},
  _: (text) => text,
});
runInContext("var window = globalThis;", context);
for (const file of ["_static/searchtools.js", "_static/language_data.js", "searchindex.js"]) {
  runInContext(readFileSync(join(folder, file), "utf8"), context, { filename: file });
}
context.queries = queries;
const found = runInContext(
  "queries.map((query) => Search._performSearch(...Search._parseQuery(query)))",
  context,
);
for (const hits of found) {
  const places = hits.reverse().slice(0, HITS);
  console.log(places.map(([page, , anchor]) => page + anchor).join("\t"));
}
