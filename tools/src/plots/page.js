const root = document.documentElement;
const dark = matchMedia('(prefers-color-scheme: dark)');
const drawn = new Set();

function table(data) {
  const cells = [];
  data.forEach(trace => {
    const name = trace.name || 'value';
    cells.push([name + ' x', ...trace.x], [name, ...(trace.y || [])]);
  });
  const rows = Math.max(...cells.map(column => column.length));
  let text = '';
  for (let i = 0; i < rows; i++) text += cells.map(column => i < column.length ? column[i] : '').join(',') + '\n';
  return text;
}

function save(plot) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([table(plots[plot.id].data)], {type: 'text/csv'}));
  link.download = plot.id + '.csv';
  link.click();
  URL.revokeObjectURL(link.href);
}

const tray = {width: 24, height: 24, path: 'M10 3h4v8h4l-6 7-6-7h4zM4 19h16v2H4z'};

function draw(id) {
  const plot = plots[id];
  const css = getComputedStyle(root);
  const ink = css.getPropertyValue('--ink').trim(), rule = css.getPropertyValue('--rule').trim();
  const soft = css.getPropertyValue('--soft').trim();
  // With automargin, a title that keeps its distance moves the margin instead of running into the numbers.
  const axis = old => ({...old, title: {...old.title, standoff: 10}, gridcolor: rule, zerolinecolor: rule, linecolor: rule, automargin: true,
    // Few marks: with more, Plotly writes lone digits from 1 to 9 beside each other.
    ...(old.type === 'log' ? {exponentformat: 'power', nticks: 4} : {})});
  const layout = {...plot.layout, paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', font: {color: ink},
    modebar: {bgcolor: 'rgba(0,0,0,0)', color: soft, activecolor: ink},
    // Below everything else, however many lines the names take on a narrow screen.
    legend: {...plot.layout.legend, yref: 'container', y: 0, yanchor: 'bottom'},
    xaxis: axis(plot.layout.xaxis), yaxis: axis(plot.layout.yaxis)};
  const csv = {name: 'csv', title: 'Download data as CSV', click: save, icon: tray};
  Plotly.react(id, plot.data, layout, {responsive: true, displaylogo: false, modeBarButtonsToAdd: plot.data[0].z ? [] : [csv],
    toImageButtonOptions: {format: 'svg', filename: id}});
  drawn.add(id);
}

const drawOnce = id => drawn.has(id) || draw(id);
const redraw = () => drawn.forEach(draw);
const sight = new IntersectionObserver(entries => entries.forEach(entry => {
  if (entry.isIntersecting) drawOnce(entry.target.id);
}), {rootMargin: '400px'});
document.querySelectorAll('.plot').forEach(plot => sight.observe(plot));
// Paper shows what was never scrolled to.
addEventListener('beforeprint', () => document.querySelectorAll('.plot').forEach(plot => plot.offsetParent && drawOnce(plot.id)));

document.querySelectorAll('[role=tab]').forEach(tab => tab.addEventListener('click', () => {
  tab.parentNode.querySelectorAll('[role=tab]').forEach(other => {
    other.setAttribute('aria-selected', other === tab);
    document.getElementById(other.getAttribute('aria-controls')).hidden = other !== tab;
  });
  document.getElementById(tab.getAttribute('aria-controls')).querySelectorAll('.plot').forEach(plot => {
    if (drawn.has(plot.id)) Plotly.Plots.resize(plot);
  });
}));

// A page opened from a file may be refused its storage.
function kept(theme) {
  try { return theme ? localStorage.setItem('theme', theme) : localStorage.getItem('theme'); } catch { return null; }
}
const chosen = kept();
if (chosen) root.dataset.theme = chosen;
dark.addEventListener('change', redraw);
document.getElementById('theme').addEventListener('click', () => {
  const now = root.dataset.theme || (dark.matches ? 'dark' : 'light');
  root.dataset.theme = now === 'dark' ? 'light' : 'dark';
  kept(root.dataset.theme);
  redraw();
});
