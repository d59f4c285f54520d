// Scores of the site's search: pages first, then the names of the APIs.
/* exported Scorer */
var Scorer = {
  // A page of the C++ API is long and has every word.
  score: ([docname, , , , score, , kind]) =>
    score - (kind === 'object' ? 1000 : docname.startsWith('reference/cpp-api') ? 500 : 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
