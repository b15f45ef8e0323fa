// What a page does with a script; without one it shows the same, and nothing sorts or turns.
document.documentElement.classList.add('js');

const themeButton = document.querySelector('.theme');
if (themeButton) themeButton.onclick = () => {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
  root.dataset.theme = dark ? 'light' : 'dark';
  dispatchEvent(new Event('theme'));
};

// Tables: sort by a heading, filter by words, download what is shown.
const value = cell => cell.dataset.v !== undefined ? +cell.dataset.v : cell.textContent.trim();
const before = (a, b) => {  // empty cells last, whichever way
  if (a === '' || b === '') return a === b ? 0 : a === '' ? Infinity : -Infinity;
  return typeof a === 'number' && typeof b === 'number' ? a - b : String(a).localeCompare(String(b), 'en', { numeric: true });
};
document.querySelectorAll('details.tab').forEach(table => {
  const body = table.querySelector('tbody'), heads = [...table.querySelectorAll('th')];
  heads.forEach((head, column) => head.firstElementChild.onclick = () => {
    const up = head.getAttribute('aria-sort') !== 'ascending';
    heads.forEach(other => other.setAttribute('aria-sort', 'none'));
    head.setAttribute('aria-sort', up ? 'ascending' : 'descending');
    const order = (a, b) => { const way = before(value(a.cells[column]), value(b.cells[column])); return up || !isFinite(way) ? way : -way; };
    body.append(...[...body.rows].sort(order));
  });
  const filter = table.querySelector('input');
  if (filter) filter.oninput = () => {
    const words = filter.value.toLowerCase().split(/\s+/);
    for (const row of body.rows) row.hidden = !words.every(word => row.textContent.toLowerCase().includes(word));
  };
  const csv = table.querySelector('.csv');
  if (csv) csv.onclick = () => {
    const quoted = text => /[",\n]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text;
    const shown = [...body.rows].filter(row => !row.hidden).map(row => [...row.cells].map(cell => String(value(cell))));
    const lines = [heads.map(head => head.textContent.trim()), ...shown].map(row => row.map(quoted).join(','));
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([lines.join('\r\n')], { type: 'text/csv' }));
    link.download = csv.dataset.name;
    link.click();
    URL.revokeObjectURL(link.href);
  };
});

// The day is that of the file: in it, the same results would make other bytes each day.
const written = new Date(document.lastModified);
document.querySelectorAll('.day').forEach(place => { place.textContent = written.toLocaleDateString('en-CA'); });

document.querySelectorAll('[data-copy]').forEach(button => button.onclick = async () => {
  await navigator.clipboard.writeText(document.getElementById(button.dataset.copy).textContent);
  button.textContent = 'Copied';
});

// The index: studies with all the words that are looked for.
const seek = document.querySelector('.seek');
if (seek) seek.oninput = () => {
  const words = seek.value.toLowerCase().split(/\s+/);
  const found = study => words.every(word => study.textContent.toLowerCase().includes(word));
  document.querySelectorAll('.study').forEach(study => { study.hidden = !found(study); });
  document.querySelectorAll('.group').forEach(group => { group.hidden = !group.querySelector('.study:not([hidden])'); });
};
