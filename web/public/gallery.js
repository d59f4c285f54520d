// Shows gallery.txt, which a teacher edits: groups of entries, each with a title, a link into the page
// and some words. Only the part of a link after # counts, so no entry leads to another site.
'use strict';

const LINK = /^\S*(#(?:tour|learn|write|agent|everything)\b\S*)$/;
const LONGEST = 1e6; // characters

/// Reads the text: { title, groups: [{ name, entries: [{ title, hash, text, row }] }] }.
function parse(text) {
  const gallery = { title: '', groups: [] };
  let entry = null;
  text.split(/\r?\n/).forEach((line, k) => {
    const words = line.trim();
    const heading = /^(={1,2})\s*(.*)$/.exec(words);
    if (words === '') {
      entry = null;
    } else if (/^#(\s|$)/.test(words)) {
      return; // a comment
    } else if (heading) {
      entry = null;
      if (heading[1] === '=') gallery.title = heading[2];
      else gallery.groups.push({ name: heading[2], entries: [] });
    } else {
      if (!entry) {
        entry = { title: words, hash: '', text: '', row: k + 1 };
        if (gallery.groups.length === 0) gallery.groups.push({ name: '', entries: [] });
        gallery.groups.at(-1).entries.push(entry);
        return;
      }
      const link = LINK.exec(words);
      if (link && !entry.hash) entry.hash = link[1];
      else entry.text = `${entry.text} ${words}`.trim();
    }
  });
  return gallery;
}

function make(tag, text, parent) {
  const made = document.createElement(tag);
  made.textContent = text;
  parent.append(made);
  return made;
}

function show({ title, groups }) {
  if (title) {
    document.getElementById('title').textContent = title;
    document.title = `Upswing: ${title}`;
  }
  const place = document.getElementById('groups');
  for (const { name, entries } of groups) {
    const section = make('section', '', place);
    if (name) make('h2', name, section);
    const list = make('ul', '', section);
    for (const { title: words, hash, text, row } of entries) {
      const item = make('li', '', list);
      if (hash) make('a', words, item).href = `./${hash}`;
      else make('b', words, item);
      if (text) make('p', text, item);
      if (!hash) complain(`gallery.txt, row ${row}: "${words}" has no link into the page below it.`);
    }
  }
}

function complain(text) {
  const problem = document.getElementById('problem');
  problem.textContent = `${problem.textContent} ${text}`.trim();
  problem.hidden = false;
}

async function start() {
  try {
    const theme = localStorage.getItem('upswing-theme');
    if (theme) document.documentElement.dataset.theme = theme;
  } catch {
    // this browser keeps nothing
  }
  try {
    const response = await fetch('gallery.txt', { cache: 'no-cache' });
    if (!response.ok) throw new Error(String(response.status));
    show(parse((await response.text()).slice(0, LONGEST)));
  } catch {
    complain('gallery.txt could not be read.');
  }
  document.documentElement.dataset.shown = '';
}

void start();
