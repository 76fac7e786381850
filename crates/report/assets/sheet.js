// Draws the charts of a sheet: counts over time on logarithmic axes.
(() => {
  'use strict';
  const charts = JSON.parse(document.getElementById('charts').textContent);
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
  const axis = (label, size) => ({
    label, labelSize: 18, size, stroke: () => css('dim'), grid: { stroke: () => css('grid'), width: 1 },
    ticks: { stroke: () => css('grid'), width: 1 },
  });
  const drawn = [];
  for (const chart of charts) {
    const figure = document.createElement('figure');
    const title = document.createElement('h2');
    title.textContent = chart.title;
    const place = document.createElement('div');
    const caption = document.createElement('figcaption');
    caption.textContent = chart.caption;
    figure.append(title, place, caption);
    document.getElementById('plots').append(figure);
    const colors = 'abcdefg';
    const u = new uPlot({
      width: Math.max(200, place.clientWidth), height: 240, padding: [10, 10, 0, 0], cursor: { drag: { x: true, y: false } },
      scales: { x: { time: false, distr: 3 }, y: { distr: 3, range: (u, low, high) => [0.7, Math.max(10, high * 1.5)] } },
      axes: [axis(chart.axis, 36), axis('samples', 58)],
      series: [
        { label: chart.axis, value: (u, v) => v == null ? '–' : v.toPrecision(3) },
        ...chart.curves.map((curve, i) => ({
          label: curve.label, stroke: () => css(colors[i % colors.length]), width: 1.5, dash: i < colors.length ? undefined : [4, 3],
          paths: uPlot.paths.stepped({ align: 1 }), points: { show: false }, value: (u, v) => v == null ? '–' : String(v),
        })),
      ],
    }, [chart.x, ...chart.curves.map((curve) => curve.counts.map((n) => n || null))], place);
    drawn.push({ u, place });
  }
  addEventListener('resize', () => drawn.forEach(({ u, place }) => u.setSize({ width: Math.max(200, place.clientWidth), height: 240 })));
  document.documentElement.dataset.drawn = String(drawn.length);
})();
