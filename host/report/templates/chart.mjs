// The charts of a report, drawn by uPlot: each from the data block in its place. Drag across a chart to zoom, or use its buttons; all
// panels of a chart show the same stretch.
const scheme = matchMedia('(prefers-color-scheme: dark)');
const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const inkOf = (colour) => variable(`--c${colour.slice(1).toLowerCase()}`) || colour;

// Series share an axis or have their own, in any order: rows in the order of x, in which a series that has none there is undefined
// (and its line goes on), or null where it breaks.
function rowsOf(axes, series) {
  const rows = axes.flatMap((axis, a) => {
    const here = series.filter(({ x }) => x === a);
    return here.length === 0 ? [] : axis.map((x, i) => ({ x, y: series.map((s) => (s.x === a ? (s.y[i] ?? null) : undefined)) }));
  });
  rows.sort((a, b) => a.x - b.x);
  return [rows.map(({ x }) => x), ...series.map((_, s) => rows.map(({ y }) => y[s]))];
}

function element(tag, attributes, text = '') {
  const made = Object.assign(document.createElement(tag), attributes);
  made.textContent = text;
  return made;
}

function keyOf(chart) {
  const key = element('ul', { className: 'key' });
  const named = new Map(chart.panels.flatMap(({ series }) => series.filter(({ name }) => name).map((s) => [s.name, s])));
  for (const { name, colour, dashed } of named.values()) {
    const line = element('span', { className: dashed ? 'dashed' : '' });
    line.style.borderColor = inkOf(colour);
    const item = element('li', {});
    item.append(line, name);
    key.append(item);
  }
  return key;
}

// From every other of a series' points to the next, straight up.
function intervalsOf(plot, index) {
  const stroke = new Path2D();
  const known = plot.data[0].map((x, i) => [x, plot.data[index][i]]).filter(([, y]) => y !== undefined && y !== null);
  known.forEach(([x, y], i) => stroke[i % 2 ? 'lineTo' : 'moveTo'](plot.valToPos(x, 'x', true), plot.valToPos(y, 'y', true)));
  return { stroke, fill: null, clip: null, band: null, gaps: null, flags: 0 };
}

const isNumber = (v) => v !== null && v !== undefined;
const named = (names) => (names.length ? { values: (_, ticks) => ticks.map((t) => names[t] ?? ''), splits: () => names.map((_, i) => i) } : {});

function plotOf(chart, panel, place, plots) {
  const isLast = panel === chart.panels.at(-1);
  const axis = { stroke: variable('--soft'), grid: { stroke: variable('--line'), width: 1 }, ticks: { show: false }, font: '12px system-ui, sans-serif', labelFont: '12px system-ui, sans-serif', labelSize: 18 };
  const foot = chart.names.length ? 90 : 30;
  const isTall = chart.names.length > 0;
  const x = { ...axis, size: isLast ? foot : 8, ...(isLast ? (chart.label ? { label: chart.label } : {}) : { values: (_, t) => t.map(() => '') }) };
  if (isLast) Object.assign(x, named(chart.names), isTall ? { rotate: -35 } : {});
  const range = (_, least, most) => [panel.least ?? least, panel.most ?? most];
  const shade = ({ ctx, bbox, valToPos }) => {
    ctx.fillStyle = variable('--shade');
    for (const [from, to] of chart.shaded) ctx.fillRect(valToPos(from, 'x', true), bbox.top, valToPos(to, 'x', true) - valToPos(from, 'x', true), bbox.height);
  };
  const together = (plot, name) => {
    const { min, max } = plot.scales.x;
    if (name === 'x') for (const other of plots) if (other !== plot && (other.scales.x.min !== min || other.scales.x.max !== max)) other.setScale('x', { min, max });
  };
  return new uPlot(
    {
      width: Math.max(240, place.clientWidth),
      height: chart.height + (isLast ? foot + 18 : 0),
      padding: [6, 12, 0, 0],
      legend: { show: false },
      cursor: { sync: { key: place.id }, drag: { x: true, y: false }, points: { show: false } },
      scales: {
        x: { time: false, ...(isTall ? { range: [-0.5, chart.names.length - 0.5] } : {}) },
        y: panel.log ? { distr: 3 } : isNumber(panel.least) || isNumber(panel.most) ? { range } : {},
      },
      axes: [x, { ...axis, label: panel.label, size: 48 }],
      series: [
        {},
        ...panel.series.map(({ colour, style, width, dashed }) => ({
          stroke: inkOf(colour),
          width: style === 'points' ? 0 : width,
          ...(dashed ? { dash: [6, 4] } : {}),
          ...(style === 'intervals' ? { paths: intervalsOf } : {}),
          ...(style === 'steps' ? { paths: uPlot.paths.stepped({ align: 1 }) } : {}),
          points: style === 'points' ? { show: true, size: width * 1.6, fill: inkOf(colour), width: 0 } : { show: false },
        })),
      ],
      hooks: { drawClear: [shade], setScale: [together] },
    },
    rowsOf(chart.axes, panel.series),
    place,
  );
}

// By a share of what is seen, never beyond what there is.
function move(plots, whole, zoom, shift) {
  const { min, max } = plots[0].scales.x;
  const half = Math.min((whole[1] - whole[0]) / 2, ((max - min) / 2) * zoom);
  const middle = Math.min(whole[1] - half, Math.max(whole[0] + half, (min + max) / 2 + shift * (max - min)));
  for (const plot of plots) plot.setScale('x', { min: middle - half, max: middle + half });
}

function draw(place) {
  const chart = JSON.parse(place.querySelector('script').textContent);
  const drawing = element('div', { className: 'drawing' });
  const plots = [];
  place.querySelector('.drawing')?.remove();
  place.append(drawing);
  drawing.append(keyOf(chart));
  for (const panel of chart.panels) {
    const at = element('div', { id: `${place.id}-panels` });
    drawing.append(at);
    plots.push(plotOf(chart, panel, at, plots));
    at.removeAttribute('id');
  }
  if (place.closest('.wide')) {
    const { min, max } = plots[0].scales.x;
    const buttons = [['−', 'Zoom out', 2, 0], ['+', 'Zoom in', 0.5, 0], ['←', 'Earlier', 1, -0.25], ['→', 'Later', 1, 0.25]].map(([sign, title, zoom, shift]) =>
      element('button', { type: 'button', title, ariaLabel: title, onclick: () => move(plots, [min, max], zoom, shift) }, sign));
    const bar = element('div', { className: 'zoom' });
    bar.append(...buttons, 'or draw across a panel; a double click shows all');
    drawing.prepend(bar);
  }
  new ResizeObserver(() => {
    const width = Math.max(240, drawing.clientWidth);
    for (const plot of plots) if (plot.width !== width) plot.setSize({ width, height: plot.height });
  }).observe(drawing);
}

const drawAll = () => document.querySelectorAll('.chart').forEach(draw);
drawAll();
scheme.addEventListener('change', drawAll);
