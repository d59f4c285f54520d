// The search of the documentation. Sphinx's own search shows only pages that contain every word, and
// orders them by name. This one ranks sections: by their headings, by the words of docs/search.toml,
// and by the text of their page. tools/docs.py puts those words before it as SEARCH_WORDS. Sphinx copies
// both into language_data.js, which runs after searchtools.js.
/* global SEARCH_WORDS, Search, SearchResultKind, Stemmer, splitQuery, stopwords */
/* exported Scorer */

// Scores of names in the APIs, which follow the sections.
var Scorer = {
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
};

(() => {
  const WEIGHTS = { title: 1.2, heading: 1, index: 1.5 };
  const MOST = 30; // results
  const MOST_OF_A_PAGE = 2;
  const WORST = 0.2; // share of the best score

  // Pages that mention every word, but seldom answer a question.
  const LAST = [
    ['development/changelog', 0.1],
    ['reference/cpp-api', 0.2],
    ['development/', 0.6],
    ['reference/command-line', 0.6],
    ['reference/run-folder', 0.8],
    ['reference/settings', 0.7],
  ];

  // Words of questions, which do not tell what a question is about.
  const ASKING = new Set([
    'can',
    'explain',
    'get',
    'mean',
    'need',
    'show',
    'use',
    'using',
    'want',
    'will',
  ]);

  const stemmer = new Stemmer();
  let sections = null; // [{ file, anchor, words, kind }]
  let headings = null; // by file and anchor
  let vocabulary = null; // Map: stem of a word -> Set of files

  /// The stems of a text's words, without words such as "what", "is" and "my" if others are left.
  function wordsOf(text) {
    const words = splitQuery(text.toLowerCase());
    const telling = words.filter((word) => !stopwords.has(word) && !ASKING.has(word));
    return [
      ...new Set((telling.length > 0 ? telling : words).map((word) => stemmer.stemWord(word))),
    ];
  }

  function prepare({ docnames, terms, titleterms, alltitles }) {
    vocabulary = new Map();
    const learn = (word, files) => {
      if (!vocabulary.has(word)) vocabulary.set(word, new Set());
      for (const file of files) vocabulary.get(word).add(file);
    };
    for (const [word, files] of [...Object.entries(terms), ...Object.entries(titleterms)]) {
      learn(word, [files].flat());
    }
    sections = [];
    headings = new Map();
    const add = (text, file, anchor, kind) => {
      const words = wordsOf(text);
      for (const word of words) learn(word, [file]);
      sections.push({ file, anchor: anchor ? `#${anchor}` : '', words, kind });
    };
    for (const [text, places] of Object.entries(alltitles)) {
      for (const [file, anchor] of places) {
        add(text, file, anchor, anchor === null ? 'title' : 'heading');
        if (anchor !== null) headings.set(`${file}#${anchor}`, text);
      }
    }
    for (const [place, texts] of Object.entries(SEARCH_WORDS)) {
      const [page, anchor] = place.split('#');
      const file = docnames.indexOf(page);
      for (const text of texts) add(text, file, anchor, 'index');
    }
  }

  /// The words of the documentation that a word of the query stands for: itself, else longer ones.
  function meanings(word) {
    if (vocabulary.has(word) || word.length < 3) return [word];
    const longer = [...vocabulary.keys()].filter((known) => known.startsWith(word));
    return longer.length > 0 ? longer : [word];
  }

  /// Results for a query, the worst first, as Sphinx expects them.
  function find(query) {
    const index = Search._index;
    if (!sections) prepare(index);
    const asked = wordsOf(query).map((word) => {
      const words = meanings(word);
      const files = new Set(words.flatMap((known) => [...(vocabulary.get(known) ?? [])]));
      const weight = Math.log(1 + index.docnames.length / (1 + files.size)); // rare words count most
      return { words, files, weight };
    });
    const all = asked.reduce((sum, { weight }) => sum + weight, 0);
    const share = (has) =>
      asked.filter(has).reduce((sum, { weight }) => sum + weight, 0) / (all || 1);
    const pages = index.docnames.map((name, file) => {
      const text = share(({ files }) => files.has(file));
      const [, factor] = LAST.find(([start]) => name.startsWith(start)) ?? ['', 1];
      return { text, factor, title: wordsOf(index.titles[file]) };
    });

    const best = new Map(); // by page and anchor
    const offer = (file, anchor, score) => {
      const place = `${file}${anchor}`;
      if (score > (best.get(place)?.score ?? 0)) best.set(place, { file, anchor, score });
    };
    pages.forEach(({ text, factor }, file) => offer(file, '', factor * text));
    for (const { file, anchor, words, kind } of sections) {
      const { text, factor, title } = pages[file];
      const inHeading = ({ words: known }) => known.some((word) => words.includes(word));
      const hits = asked.filter(inHeading).length;
      if (hits === 0) continue;
      const covered = share(
        (one) => inHeading(one) || one.words.some((word) => title.includes(word)),
      );
      // A part of an index word says little: "Bellman equation" is not about any equation.
      const part = hits / Math.max(words.length, hits);
      const exact = kind === 'index' ? part ** 2 : part;
      const isNamed = kind !== 'heading' && covered === 1 && exact === 1;
      const score =
        2 * WEIGHTS[kind] * covered * (kind === 'index' ? exact : 0.4 + 0.6 * exact) + text;
      offer(file, anchor, isNamed ? score : factor * score);
    }
    return order(index, [...best.values()]);
  }

  function order({ docnames, filenames, titles }, found) {
    found.sort((a, b) => b.score - a.score || a.file - b.file);
    const results = [];
    const counts = new Map();
    for (const { file, anchor, score } of found) {
      if (results.length === MOST || score < WORST * found[0].score) break;
      const count = counts.get(file) ?? 0;
      if (count === MOST_OF_A_PAGE) continue;
      counts.set(file, count + 1);
      const heading = headings.get(`${file}${anchor}`);
      const title = heading ? `${titles[file]} > ${heading}` : titles[file];
      const kind = heading ? SearchResultKind.title : SearchResultKind.text;
      results.push([docnames[file], title, anchor, null, score, filenames[file], kind]);
    }
    return results.reverse();
  }

  Search._performSearch = (query, _searchTerms, _excludedTerms, _highlightTerms, objectTerms) => {
    const names = [...objectTerms].flatMap((term) => Search.performObjectSearch(term, objectTerms));
    names.sort((a, b) => a[4] - b[4]);
    const places = new Set();
    const isNew = ([page, , anchor]) => !places.has(page + anchor) && places.add(page + anchor);
    return [...names.reverse().filter(isNew).reverse(), ...find(query)];
  };
})();
