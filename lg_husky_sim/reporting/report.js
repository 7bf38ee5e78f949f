'use strict';
// The live part of a report: signals to zoom in, the path coloured by its error, jumps between them.
// All texts and numbers come from #report-data; plotly comes packed in #plotly-gzip.
(async () => {
  const $ = (name) => document.getElementById(name);
  const data = JSON.parse($('report-data').textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const floats = (one) => (one === null ? null
    : typeof one === 'number' ? one
    : one.f8 ? new Float64Array(bytes(one.f8).buffer) : new Float32Array(bytes(one.f4).buffer));
  // Plotly reads <b> and <a> in texts: names of files and topics must stay what they are.
  const plain = (text) => String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;');
  const coarse = matchMedia('(pointer: coarse)').matches;
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const narrow = () => innerWidth < 700;

  const packed = new Blob([bytes($('plotly-gzip').textContent.trim())]);
  const stream = packed.stream().pipeThrough(new DecompressionStream('gzip'));
  const library = document.createElement('script');
  library.textContent = await new Response(stream).text();
  document.head.append(library);
  const Plotly = window.Plotly;

  for (const trace of data.traces) {
    trace.t = floats(trace.t); trace.m = floats(trace.m); trace.s = floats(trace.s);
    trace.p = trace.p.map(floats);
  }
  const find = (recording, channel) => data.traces.find(
    (one) => one.r === recording && one.c === channel);
  const state = { recording: 0, errors: false, column: data.columns.length - 1, range: null };
  if (data.view) state.recording = data.view.r;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const line = (column) => {
    const one = data.columns[column];
    return { color: dark.matches ? one.dark : one.light, width: 1.5, dash: one.dash };
  };
  const base = (height) => ({
    height, margin: { l: narrow() ? 46 : 62, r: 8, t: 8, b: 38 },
    paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)',
    font: { family: 'system-ui, sans-serif', size: narrow() ? 11 : 12, color: colour('--ink') },
    legend: { orientation: 'h', y: 1.0, yanchor: 'bottom', x: 0, itemwidth: 30 },
    modebar: { bgcolor: 'rgba(0,0,0,0)', color: colour('--soft'), activecolor: colour('--link') },
    dragmode: coarse ? false : 'zoom', hoverlabel: { bgcolor: colour('--card'),
      font: { color: colour('--ink') }, bordercolor: colour('--line') },
  });
  const axis = (more) => ({ gridcolor: colour('--plot-grid'), zeroline: false,
    linecolor: colour('--line'), ticks: 'outside', tickcolor: colour('--line'),
    nticks: narrow() ? 5 : 8, ...more });
  // Ticks of a logarithmic axis as whole numbers: 200, 500, 1000, not 2, 5, 1000.
  const decades = (values) => {
    const seen = values.filter((one) => one > 0), ticks = [];
    const [least, most] = [Math.min(...seen), Math.max(...seen)].map(Math.log10);
    for (let power = Math.floor(least); power <= Math.ceil(most); power += 1) {
      for (const digit of most - least < 3 ? [1, 2, 5] : [1]) ticks.push(digit * 10 ** power);
    }
    return { tickvals: ticks, ticktext: ticks.map((one) => String(Number(one.toPrecision(1)))) };
  };
  const config = { responsive: true, displaylogo: false, displayModeBar: coarse || narrow() ? false : 'hover',
    modeBarButtonsToRemove: ['lasso2d', 'select2d', 'autoScale2d'] };

  // Signals one below the other on one time axis; panels are [trace, whether errors].
  function signals(place, panels, view, height, marked) {
    const count = panels.length, figure = { data: [], layout: base(height) };
    const gap = 24 / (height - 46);
    // Many names reach below the buttons at the right: these get a line of their own.
    figure.layout.margin.t = 28 + (data.columns.length > 4 && !narrow() ? 44 : 0);
    figure.layout.legend.y = 1.0 + gap;
    const size = (1 - gap * (count - 1)) / count;
    figure.layout.xaxis = axis({ title: { text: 'time [s]' }, anchor: `y${count === 1 ? '' : count}`,
      range: view ? [view.start, view.end] : undefined });
    figure.layout.hovermode = 'x unified';
    figure.layout.hoversubplots = 'axis';
    figure.layout.shapes = [];
    figure.layout.annotations = [];
    panels.forEach(([trace, errors], index) => {
      const y = `y${index ? index + 1 : ''}`, top = 1 - index * (size + gap);
      figure.layout[`yaxis${index ? index + 1 : ''}`] = axis({
        domain: [Math.max(0, top - size), top], fixedrange: true });
      figure.layout.annotations.push({ text: `${plain(errors ? 'error of ' : '')}`
        + `${plain(data.channels[trace.c].name)} [${plain(data.channels[trace.c].unit)}]`,
        xref: 'paper', yref: 'paper', x: 0, y: top, yanchor: 'bottom', xanchor: 'left',
        showarrow: false, font: { size: 12 } });
      if (errors && trace.s !== null) {
        const s = typeof trace.s === 'number' ? trace.t.map(() => trace.s) : trace.s;
        const band = (sign, more) => ({ x: trace.t, y: s.map((one) => 2 * sign * one), yaxis: y,
          type: 'scatter', mode: 'lines', line: { width: 0 }, hoverinfo: 'skip',
          showlegend: false, ...more });
        figure.data.push(band(-1, {}), band(1, { fill: 'tonexty',
          fillcolor: dark.matches ? 'rgba(255,255,255,.13)' : 'rgba(0,0,0,.09)' }));
      }
      const one = (label, values, style, more) => figure.data.push({
        x: trace.t, y: values, yaxis: y, name: plain(label), legendgroup: label,
        showlegend: index === 0, type: 'scatter',
        mode: 'lines', line: style, hovertemplate: '%{y:.4g}', ...more });
      if (!errors) one('measured', trace.m, { color: colour('--measured'), width: 3 });
      trace.p.forEach((values, column) => {
        if (values === null) return;
        one(data.columns[column].name,
          errors ? values.map((value, k) => trace.m[k] - value) : values, line(column));
      });
    });
    const trace = panels[0][0];
    for (const jump of marked ? data.jumps.filter((one) => one.r === trace.r) : []) {
      panels.forEach(([own], index) => {
        if (own.c !== jump.c) return;
        figure.layout.shapes.push({ type: 'rect', x0: jump.start, x1: jump.end, layer: 'below',
          y0: 0, y1: 1, yref: `y${index ? index + 1 : ''} domain`, line: { width: 0 },
          fillcolor: colour('--band'), opacity: 0.45 });
      });
    }
    if (data.view && data.view.onset !== null && data.view.r === trace.r) {
      figure.layout.shapes.push({ type: 'line', x0: data.view.onset, x1: data.view.onset, y0: 0,
        y1: 1, yref: 'paper', line: { color: colour('--bad'), dash: 'dash', width: 1.5 } });
    }
    return Plotly.react(place, figure.data, figure.layout, config);
  }

  function drawFirst() {
    if (!data.view || !$('plot-first')) return;
    const trace = find(data.view.r, data.view.c);
    if (trace) signals($('plot-first'), [[trace, false], [trace, true]], data.view,
      narrow() ? 400 : 460, false);
  }
  function drawSignals() {
    if (!$('plot-signals')) return;
    const own = data.traces.filter((one) => one.r === state.recording && !data.channels[one.c].place);
    if (own.length) signals($('plot-signals'), own.map((one) => [one, state.errors]), state.range,
      80 + own.length * (narrow() ? 135 : 160), true);
  }
  function drawPath() {
    const place = $('plot-path');
    if (!place) return;
    const x = find(state.recording, 'x'), y = find(state.recording, 'y');
    place.style.display = x && y ? '' : 'none';
    if (!x || !y) return;
    // On a phone each name of the legend may need a line of its own.
    const layout = base(narrow() ? 430 + 18 * data.columns.length : 560), lines = [];
    layout.xaxis = axis({ title: { text: 'x [m]' } });
    layout.yaxis = axis({ title: { text: 'y [m]' }, scaleanchor: 'x', scaleratio: 1 });
    // Many names reach below the buttons at the right, and get a line of their own.
    if (data.columns.length > 3 && !narrow()) layout.margin.t = 52;
    layout.hovermode = 'closest';
    x.p.forEach((values, column) => {
      if (values && y.p[column]) lines.push({ x: values, y: y.p[column], type: 'scatter',
        mode: 'lines', name: plain(data.columns[column].name), line: line(column),
        opacity: column === state.column ? 1 : 0.45, hoverinfo: 'skip' });
    });
    const px = x.p[state.column], py = y.p[state.column];
    const error = px && py ? Array.from(x.m, (value, k) => Math.hypot(value - px[k], y.m[k] - py[k]))
      : null;
    const most = Math.max(...x.p.map((values, column) => (values && y.p[column]
      ? Math.max(...Array.from(x.m, (value, k) => Math.hypot(value - values[k],
        y.m[k] - y.p[column][k])).filter(Number.isFinite), 0) : 0)));
    lines.push({ x: x.m, y: y.m, customdata: x.t, type: 'scatter', mode: 'lines+markers',
      name: 'measured', line: { color: colour('--measured'), width: 1 },
      text: error ? error.map((one) => one.toPrecision(3)) : undefined,
      hovertemplate: 't = %{customdata:.2f} s<br>error %{text} m<extra></extra>',
      marker: { size: 5, color: error || colour('--measured'), cmin: 0, cmax: most,
        colorscale: [[0, dark.matches ? '#4a90c2' : '#9cc4e4'], [0.5, '#e69f00'],
          [1, dark.matches ? '#ff5a4d' : '#b3001b']],
        showscale: Boolean(error), colorbar: { ticksuffix: ' m',
          orientation: 'h', thickness: 10, yref: 'container', y: 62 / layout.height,
          yanchor: 'top', len: 0.7 } } });
    const first = x.m.findIndex(Number.isFinite);
    lines.push({ x: [x.m[first]], y: [y.m[first]], type: 'scatter', mode: 'markers', name: 'start',
      marker: { symbol: 'triangle-right', size: 12, color: colour('--ink') }, hoverinfo: 'skip' });
    layout.margin.b = 124;
    Plotly.react(place, lines, layout, config).then(() => {
      place.removeAllListeners('plotly_click');
      place.on('plotly_click', (event) => {
        const t = event.points[0].customdata;
        if (Number.isFinite(t)) show(t - 5, t + 5);
      });
    });
  }
  const charts = Object.fromEntries(data.charts.map((one) => [one.name, one]));
  function drawCharts() {
    for (const place of document.querySelectorAll('[data-chart]')) {
      const one = charts[place.dataset.chart], layout = base(narrow() ? 300 : 340), lines = [];
      if (!one || !place.offsetParent) continue;
      layout.xaxis = axis({ title: { text: plain(one.x) } });
      layout.yaxis = axis({ title: { text: plain(one.y) }, automargin: true, type: one.log ? 'log' : 'linear',
        ...(one.log ? decades(one.lines.flatMap((own) => Array.from(floats(own.y)))) : {}) });
      one.lines.forEach((own, index) => {
        const shade = data.palette[index % data.palette.length][dark.matches ? 1 : 0];
        const x = floats(own.x), y = floats(own.y), s = floats(own.s);
        if (s !== null) {
          const band = (sign, more) => ({ x, y: y.map((value, k) => value + sign * s[k]),
            type: 'scatter', mode: 'lines', line: { width: 0 }, hoverinfo: 'skip',
            showlegend: false, ...more });
          lines.push(band(-1, {}), band(1, { fill: 'tonexty', fillcolor: `${shade}33` }));
        }
        lines.push({ x, y, type: 'scatter', mode: own.dots ? 'markers' : 'lines',
          name: plain(own.label), line: { color: shade, width: 1.5 },
          marker: { color: shade, size: 4 }, hovertemplate: '%{y:.4g}' });
      });
      layout.showlegend = one.lines.length > 1;
      layout.hovermode = one.lines.length > 1 ? 'x unified' : 'closest';
      Plotly.react(place, lines, layout, config);
    }
  }

  function show(start, end) {
    const own = data.traces.filter((one) => one.r === state.recording).map((one) => one.t);
    state.range = { start: Math.max(start, Math.min(...own.map((t) => t[0]))),
      end: Math.min(end, Math.max(...own.map((t) => t[t.length - 1]))) };
    drawSignals();
    $('explorer').scrollIntoView({ behavior: 'smooth' });
  }
  function choose(recording) {
    state.recording = recording;
    state.range = null;
    if ($('recording')) $('recording').value = String(recording);
    drawSignals(); drawPath();
  }
  function span() {
    const range = $('plot-signals').layout.xaxis.range;
    return [Number(range[0]), Number(range[1])];
  }
  function pressed(buttons, chosen) {
    for (const one of buttons) one.setAttribute('aria-pressed', String(one === chosen));
  }
  function connect() {
    data.recordings.forEach((name, index) => $('recording')?.add(new Option(name, String(index))));
    $('recording')?.addEventListener('change', (event) => choose(Number(event.target.value)));
    const shows = document.querySelectorAll('[data-show]');
    for (const one of shows) one.addEventListener('click', () => {
      state.errors = one.dataset.show === 'errors';
      const [start, end] = span();
      state.range = { start, end };
      pressed(shows, one); drawSignals();
    });
    for (const one of document.querySelectorAll('[data-zoom]')) one.addEventListener('click', () => {
      const [start, end] = span(), middle = (start + end) / 2, wide = end - start;
      const moves = { in: [middle - wide / 4, middle + wide / 4], back: [start - wide / 2, end - wide / 2],
        out: [middle - wide, middle + wide], on: [start + wide / 2, end + wide / 2] };
      const to = moves[one.dataset.zoom];
      Plotly.relayout($('plot-signals'), to ? { 'xaxis.range': to } : { 'xaxis.autorange': true });
    });
    const columns = document.querySelectorAll('[data-column]');
    for (const one of columns) one.addEventListener('click', () => {
      state.column = Number(one.dataset.column);
      pressed(columns, one); drawPath();
    });
    for (const one of document.querySelectorAll('[data-jump]')) one.addEventListener('click', () => {
      const jump = data.jumps[Number(one.dataset.jump)];
      if (jump.r !== state.recording) choose(jump.r);
      const room = Math.max(1, 0.5 * (jump.end - jump.start));
      show(jump.start - room, jump.end + room);
    });
    for (const one of document.querySelectorAll('details')) one.addEventListener('toggle', drawCharts);
    addEventListener('beforeprint', () => {
      for (const one of document.querySelectorAll('details')) one.open = true;
    });
  }
  function draw() { drawFirst(); drawSignals(); drawPath(); drawCharts(); }

  document.body.classList.add('alive');
  connect();
  if ($('recording')) $('recording').value = String(state.recording);
  draw();
  dark.addEventListener('change', draw);
})().catch((error) => {
  // The pictures stay as they are: an old browser shows the report, but not live.
  document.body.classList.remove('alive');
  console.error('the live signals cannot be shown:', error);
});
