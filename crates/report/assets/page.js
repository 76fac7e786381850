// Draws the page. All numbers come from the two script elements `head` (JSON) and `data` (packed columns).
(async () => {
  'use strict';
  const started = performance.now();
  const byId = (id) => document.getElementById(id);
  const make = (tag, properties = {}, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };
  const H = JSON.parse(byId('head').textContent);

  // --- data: base64, gzip, bytes by rank, differences, steps
  const packed = Uint8Array.from(atob(byId('data').textContent.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  const raw = new Uint8Array(await new Response(stream).arrayBuffer());
  let offset = 0;
  const column = ({ n, step }) => {
    const out = new Float64Array(n);
    let now = 0;
    for (let i = 0; i < n; i++) {
      const at = offset + i;
      now = (now + (raw[at] | raw[at + n] << 8 | raw[at + 2 * n] << 16 | raw[at + 3 * n] << 24)) | 0;
      out[i] = now === -2147483648 ? NaN : now * step;
    }
    offset += 4 * n;
    return out;
  };
  for (const plot of H.plots) {
    for (const curve of plot.curves) {
      curve.values = Array.from(column(curve.data), (value) => Number.isFinite(value) ? value : null);
      if (curve.joint) curve.joint = column(curve.joint);
    }
  }
  for (const replay of H.replays) {
    for (const name of Object.keys(replay.columns)) replay.columns[name] = replay.columns[name].map(column);
  }

  // --- colours follow the scheme, also while the page is open
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
  const T = Array.from({ length: H.time.n }, (_, i) => H.time.from + i * H.time.step);
  const plots = [];
  let seekTo = () => {};
  let zooming = false;

  const shade = (u) => {
    const { ctx } = u;
    const { left, top, width, height } = u.bbox;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    for (const [foot, from, to] of H.swings) {
      const a = u.valToPos(from, 'x', true), b = u.valToPos(to, 'x', true);
      if (b < left || a > left + width) continue;
      ctx.fillStyle = css(foot ? 'right-air' : 'left-air');
      ctx.fillRect(a, top, b - a, height);
    }
    for (const { time, kind } of H.events) {
      const x = u.valToPos(time, 'x', true);
      if (x < left || x > left + width || kind === 'log') continue;
      ctx.strokeStyle = css(kind === 'fall' || kind === 'hold' ? 'bad' : kind === 'push' ? 'e' : 'g');
      ctx.setLineDash(kind === 'fall' ? [] : [4, 4]);
      ctx.lineWidth = (kind === 'fall' ? 2 : 1) * devicePixelRatio;
      ctx.beginPath();
      ctx.moveTo(x, top);
      ctx.lineTo(x, top + height);
      ctx.stroke();
    }
    ctx.restore();
  };
  const limit = (plot) => (u) => {
    if (!plot.line) return;
    const { ctx } = u;
    const y = u.valToPos(plot.line[0], 'y', true);
    if (y < u.bbox.top || y > u.bbox.top + u.bbox.height) return;
    ctx.save();
    ctx.strokeStyle = css('bad');
    ctx.setLineDash([6, 4]);
    ctx.beginPath();
    ctx.moveTo(u.bbox.left, y);
    ctx.lineTo(u.bbox.left + u.bbox.width, y);
    ctx.stroke();
    ctx.restore();
  };
  const axis = (label, size) => ({
    stroke: () => css('dim'), grid: { stroke: () => css('grid'), width: 1 }, ticks: { stroke: () => css('grid'), width: 1 },
    label, labelSize: 18, labelFont: '12px system-ui', font: '12px system-ui', size, labelGap: 0,
  });
  const dashOf = (curve) => curve.run ? [2, 3] : curve.dashed ? [7, 4] : undefined;
  const box = (plot) => {
    const place = make('div', { className: 'plot' });
    const figure = make('figure', { id: 'figure-' + plot.id }, make('h2', { textContent: plot.title }), place,
      make('figcaption', { textContent: plot.caption }));
    byId('plots').append(figure);
    return place;
  };
  const WIDTH_MIN = 200, HEIGHT = 230;
  const widthOf = (place) => Math.max(WIDTH_MIN, place.clientWidth);

  const draw = (plot) => {
    const place = box(plot);
    const value = (curve) => (u, v, s, i) => {
      if (v == null) return '–';
      const joint = curve.joint && i != null ? H.joints[curve.joint[i]] : undefined;
      return v.toFixed(plot.digits) + (plot.unit ? ' ' + plot.unit : '') + (joint ? ' ' + joint : '');
    };
    const u = new uPlot({
      width: widthOf(place), height: HEIGHT, padding: [10, 10, 0, 0],
      cursor: { sync: { key: 'walk' }, drag: { x: true, y: false, dist: 6 }, focus: { prox: 24 } },
      focus: { alpha: 0.35 },
      scales: { x: { time: false }, y: plot.logarithmic ? { distr: 3, range: () => plot.logarithmic } : {} },
      axes: [axis('walk time (s)', 36), axis(plot.axis, 58)],
      bands: plot.band ? [{ series: [plot.band[1] + 1, plot.band[0] + 1], fill: () => css('g') + '22' }] : [],
      series: [
        { label: 'time', value: (u, v) => v == null ? '–' : v.toFixed(3) + ' s' },
        ...plot.curves.map((curve) => ({
          label: curve.label, stroke: () => css(curve.color), width: curve.width, dash: dashOf(curve), points: { show: false },
          spanGaps: false, value: value(curve),
        })),
      ],
      hooks: {
        drawClear: [shade], draw: [limit(plot), mark],
        setScale: [(u, key) => {
          mark(u);
          if (key !== 'x' || zooming) return;
          zooming = true;
          const { min, max } = u.scales.x;
          for (const other of plots) if (other.u !== u && other.timed) other.u.setScale('x', { min, max });
          zooming = false;
        }],
      },
    }, [T, ...plot.curves.map((curve) => curve.values)], place);
    let down = null;
    u.over.addEventListener('mousedown', (event) => { down = event.clientX; });
    u.over.addEventListener('mouseup', (event) => {
      if (down != null && Math.abs(event.clientX - down) < 4 && u.cursor.idx != null) seekTo(T[u.cursor.idx]);
    });
    u.marker = make('div', { className: 'now' });
    u.over.append(u.marker);
    plots.push({ u, place, timed: true });
  };

  // How often a tick took how long: both logarithmic, so that one slow tick among thousands is seen.
  const histogram = (plot) => {
    const place = box({
      id: 'histogram', title: 'Computing times: how often',
      caption: 'Ticks by computing time, eight classes to the doubling. Both axes are logarithmic. Dashed: the control period, 5 ms.',
    });
    const PER_OCTAVE = 8;
    const classes = plot.curves.map((curve) => {
      const counts = new Map();
      for (const v of curve.values) if (v > 0) {
        const k = Math.floor(Math.log2(v) * PER_OCTAVE);
        counts.set(k, (counts.get(k) || 0) + 1);
      }
      return counts;
    });
    const keys = classes.flatMap((counts) => [...counts.keys()]);
    if (!keys.length) return;
    const first = Math.min(...keys), last = Math.max(...keys) + 1;
    const x = [], data = classes.map(() => []);
    for (let k = first; k <= last; k++) {
      x.push(2 ** (k / PER_OCTAVE));
      classes.forEach((counts, i) => data[i].push(counts.get(k) || null));
    }
    const u = new uPlot({
      width: widthOf(place), height: HEIGHT, padding: [10, 10, 0, 0], cursor: { drag: { x: false, y: false } },
      scales: { x: { time: false, distr: 3 }, y: { distr: 3, range: (u, low, high) => [0.7, Math.max(10, high * 1.5)] } },
      axes: [axis('computing time (ms)', 36), axis('ticks', 58)],
      series: [
        { label: 'time', value: (u, v) => v == null ? '–' : v.toPrecision(3) + ' ms' },
        ...plot.curves.map((curve) => ({
          label: curve.label, stroke: () => css(curve.color), width: 1.5, dash: dashOf(curve), paths: uPlot.paths.stepped({ align: 1 }),
          points: { show: false }, value: (u, v) => v == null ? '–' : String(v),
        })),
      ],
      hooks: { draw: [(u) => {
        const px = u.valToPos(5, 'x', true);
        if (px < u.bbox.left || px > u.bbox.left + u.bbox.width) return;
        u.ctx.save();
        u.ctx.strokeStyle = css('bad');
        u.ctx.setLineDash([6, 4]);
        u.ctx.beginPath();
        u.ctx.moveTo(px, u.bbox.top);
        u.ctx.lineTo(px, u.bbox.top + u.bbox.height);
        u.ctx.stroke();
        u.ctx.restore();
      }] },
    }, [x, ...data], place);
    plots.push({ u, place, timed: false });
  };

  // The time mark is an element: ten canvases are never drawn again for it.
  let nowTime = null;
  function mark(u) {
    if (!u.marker || nowTime == null) return;
    const x = u.valToPos(nowTime, 'x');
    u.marker.style.display = x < 0 || x > u.over.clientWidth ? 'none' : '';
    u.marker.style.transform = `translateX(${x}px)`;
  }

  for (const plot of H.plots) {
    draw(plot);
    if (plot.id === 'tick') histogram(plot);
  }
  const resize = () => plots.forEach(({ u, place }) => u.setSize({ width: widthOf(place), height: HEIGHT }));
  addEventListener('resize', resize);

  // --- replay
  const canvas = byId('view'), seek = byId('seek'), clock = byId('clock'), play = byId('play'), rate = byId('rate');
  const main = H.replays[0];
  let render = () => {};
  const repaint = [];
  if (main) {
    try {
      render = scene();
    } catch (error) {
      canvas.replaceWith(make('p', {
        className: 'note', id: 'no-view',
        textContent: `The replay needs WebGL, which this browser does not offer (${error.message}). The figures are complete.`,
      }));
    }
  }

  function scene() {
    const three = T3;
    const renderer = new three.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    const world = new three.Scene();
    const camera = new three.PerspectiveCamera(32, 1, 0.05, 200);
    camera.up.set(0, 0, 1);
    const controls = new three.OrbitControls(camera, canvas);
    controls.enableDamping = false;
    world.add(new three.HemisphereLight(0xffffff, 0x77808a, 2.1));
    const sun = new three.DirectionalLight(0xffffff, 1.7);
    sun.position.set(2, -3, 4);
    world.add(sun);
    let ground = null;
    const dress = () => {
      world.background = new three.Color(css('sky'));
      if (ground) world.remove(ground);
      ground = new three.GridHelper(10, 100, new three.Color(css('g')), new three.Color(css('line')));
      ground.rotation.x = Math.PI / 2;
      ground.position.z = -0.001;
      world.add(ground);
    };
    dress();
    repaint.push(dress);
    const bodies = H.replays.map((replay, index) => body(three, world, replay, index));
    const from = bodies[0].where(0), to = bodies[0].where(main.n - 1);
    const middle = [0, 1].map((i) => Number.isFinite(from[i] + to[i]) ? (from[i] + to[i]) / 2 : 0);
    const reach = Math.min(3, Math.hypot(to[0] - from[0], to[1] - from[1]) || 0);
    controls.target.set(middle[0], middle[1], 0.74);
    const away = 2.85 + 0.5 * reach;
    camera.position.set(middle[0] + 0.72 * away, middle[1] - 0.78 * away, 0.74 + 0.2 * away);
    camera.lookAt(controls.target);
    controls.update();
    controls.addEventListener('change', () => show());
    let follow = to.slice(0, 2).some(Number.isFinite) && Math.hypot(to[0] - from[0], to[1] - from[1]) > 1.2;
    controls.addEventListener('start', () => { follow = false; });
    return (frame) => {
      bodies.forEach((one) => one.pose(frame));
      if (follow) {
        const [x, y] = bodies[0].where(frame);
        if (Number.isFinite(x + y)) {
          const dx = x - controls.target.x, dy = y - controls.target.y;
          controls.target.x += dx; controls.target.y += dy;
          camera.position.x += dx; camera.position.y += dy;
          camera.lookAt(controls.target);
        }
      }
      const width = canvas.clientWidth, height = canvas.clientHeight;
      if (canvas.width !== Math.floor(width * renderer.getPixelRatio()) || canvas.height !== Math.floor(height * renderer.getPixelRatio())) {
        renderer.setSize(width, height, false);
        camera.aspect = width / height;
        camera.updateProjectionMatrix();
      }
      renderer.render(world, camera);
    };
  }

  function body(three, world, replay, index) {
    const { columns } = replay;
    const shift = index ? Math.round((main.from - replay.from) / replay.step) : 0;
    const at = (name, frame) => (columns[name] || []).map((values) => values[Math.max(0, Math.min(replay.n - 1, frame + shift))]);
    const ghost = index ? { transparent: true, opacity: 0.35 } : {};
    const solid = (color) => new three.MeshLambertMaterial({ color, ...ghost });
    const geometry = ({ kind, size }) => {
      if (kind === 'box') return new three.BoxGeometry(...size);
      if (kind === 'sphere') return new three.SphereGeometry(size[0], 20, 14);
      return new three.CylinderGeometry(size[0], size[0], size[1], 24).rotateX(Math.PI / 2);
    };
    const nodes = replay.links.map((link) => {
      const node = new three.Group();
      node.position.fromArray(link.position);
      node.quaternion.fromArray(link.quaternion);
      node.home = { position: node.position.clone(), quaternion: node.quaternion.clone(), axis: new three.Vector3().fromArray(link.axis) };
      for (const shape of link.shapes) {
        const mesh = new three.Mesh(geometry(shape), solid(new three.Color().setRGB(...shape.color, 'srgb')));
        mesh.position.fromArray(shape.position);
        mesh.quaternion.fromArray(shape.quaternion);
        node.add(mesh);
      }
      return node;
    });
    replay.links.forEach((link, i) => (link.parent < 0 ? world : nodes[link.parent]).add(nodes[i]));
    const soles = [0x1f7fc0, 0xd2611a].map((color) => {
      const mesh = new three.Mesh(new three.BoxGeometry(...replay.sole).translate(0, 0, replay.sole[2] / 2), solid(color));
      world.add(mesh);
      return mesh;
    });
    const above = (mesh, order) => { mesh.material.depthTest = false; mesh.renderOrder = order; world.add(mesh); return mesh; };
    const dot = (radius, color, order) => above(new three.Mesh(new three.SphereGeometry(radius, 20, 14), new three.MeshBasicMaterial({ color, ...ghost })), order);
    const arrow = (color) => {
      const group = new three.Group();
      const paint = () => new three.MeshBasicMaterial({ color, depthTest: false, ...ghost });
      const shaft = new three.Mesh(new three.CylinderGeometry(0.006, 0.006, 1, 12).translate(0, 0.5, 0), paint());
      const tip = new three.Mesh(new three.CylinderGeometry(0, 0.018, 0.05, 16).translate(0, -0.025, 0), paint());
      shaft.renderOrder = tip.renderOrder = 3;
      group.add(shaft, tip);
      world.add(group);
      const up = new three.Vector3(0, 1, 0), direction = new three.Vector3();
      return (from, force, scale) => {
        direction.fromArray(force);
        const length = direction.length() * scale;
        group.visible = length > 0.01 && from.every(Number.isFinite);
        if (!group.visible) return;
        group.position.fromArray(from);
        group.quaternion.setFromUnitVectors(up, direction.normalize());
        shaft.scale.y = Math.max(1e-3, length - 0.05);
        tip.position.y = length;
      };
    };
    const forces = [arrow(0xd81b60), arrow(0xd81b60)], push = arrow(0xe6a100);
    const com = dot(0.02, 0x00a078, 4), zmp = dot(0.012, 0xd81b60, 5);
    zmp.scale.z = 0.3;
    const turn = new three.Quaternion();
    const place = (object, pose) => {
      object.visible = pose.length === 7 && pose.every(Number.isFinite);
      if (!object.visible) return;
      object.position.set(pose[0], pose[1], pose[2]);
      object.quaternion.set(pose[3], pose[4], pose[5], pose[6]).normalize();
    };
    return {
      where: (frame) => at('base', frame).slice(0, 2),
      pose: (frame) => {
        if (nodes.length) place(nodes[0], at('base', frame));
        const angles = at('joint', frame);
        replay.links.forEach((link, i) => {
          if (link.joint < 0 || !i) return;
          const moved = link.multiplier * (angles[link.joint] || 0) + link.offset, { home } = nodes[i];
          if (link.slides) {
            nodes[i].position.copy(home.axis).multiplyScalar(moved).applyQuaternion(home.quaternion).add(home.position);
          } else {
            nodes[i].quaternion.copy(home.quaternion).multiply(turn.setFromAxisAngle(home.axis, moved));
          }
        });
        ['l', 'r'].forEach((side, foot) => {
          const pose = at('sole_' + side, frame);
          place(soles[foot], pose);
          const [x, y] = at('zmp_' + side, frame), force = at('force_' + side, frame);
          const from = Number.isFinite(x) ? [x, y, 0] : [pose[0], pose[1], 0];
          forces[foot](from, force.length === 3 && force.every(Number.isFinite) ? force : [0, 0, 0], 1e-3);
        });
        const pushed = at('push', frame);
        push(at('push_at', frame), pushed.length === 3 && pushed.every(Number.isFinite) ? pushed : [0, 0, 0], 4e-3);
        const centre = at('com', frame), point = at('zmp', frame);
        com.visible = centre.length === 3 && centre.every(Number.isFinite);
        if (com.visible) com.position.fromArray(centre);
        zmp.visible = point.length === 2 && point.every(Number.isFinite);
        if (zmp.visible) zmp.position.set(point[0], point[1], 0.002);
      },
    };
  }

  let frame = 0, playing = false, last = 0, showing = false;
  function show() {
    if (showing) return;
    showing = true;
    render(Math.round(frame));
    showing = false;
  }
  function set(to) {
    if (!main) return;
    frame = Math.max(0, Math.min(main.n - 1, to));
    seek.value = Math.round(frame);
    nowTime = main.from + Math.round(frame) * main.step;
    clock.textContent = nowTime.toFixed(2) + ' s';
    seek.setAttribute('aria-valuetext', clock.textContent);
    show();
    plots.forEach(({ u }) => mark(u));
  }
  function pause(now) {
    playing = now;
    play.textContent = playing ? '❚❚' : '▶';
    play.setAttribute('aria-pressed', String(playing));
    if (playing) { last = performance.now(); requestAnimationFrame(tick); }
  }
  function tick(time) {
    if (!playing) return;
    const passed = (time - last) / 1e3 * Number(rate.value);
    last = time;
    const next = frame + Math.max(0, passed) / main.step;
    set(next >= main.n - 1 ? 0 : next);
    requestAnimationFrame(tick);
  }
  if (main) {
    seek.max = main.n - 1;
    seekTo = (time) => set((time - main.from) / main.step);
    seek.addEventListener('input', () => set(Number(seek.value)));
    play.addEventListener('click', () => pause(!playing));
    document.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || /^(SELECT|BUTTON|SUMMARY|A)$/.test(event.target.tagName)) return;
      const steps = { ArrowRight: 1, ArrowLeft: -1, PageDown: 50, PageUp: -50 };
      if (event.key === ' ') pause(!playing);
      else if (event.target === seek) return;
      else if (event.key in steps && !/^Page/.test(event.key)) set(Math.round(frame) + steps[event.key]);
      else return;
      event.preventDefault();
    });
    new ResizeObserver(() => show()).observe(byId('replay'));
  }
  for (const event of H.events) {
    const button = make('button', { type: 'button', className: event.kind, textContent: `${event.time.toFixed(2)} s · ${event.text}` });
    button.addEventListener('click', () => seekTo(event.time));
    byId('events').append(button);
  }
  dark.addEventListener('change', () => {
    repaint.forEach((paint) => paint());
    plots.forEach(({ u }) => u.redraw(false));
    show();
  });
  const asked = () => { const found = location.hash.match(/t=(-?[\d.]+)/); return found ? Number(found[1]) : null; };
  addEventListener('hashchange', () => { const time = asked(); if (time != null) seekTo(time); });
  const first = asked() ?? H.show;
  seekTo(first);
  document.body.dataset.ready = (performance.now() - started).toFixed(0);
})().catch((error) => {
  console.error(error);
  const note = document.createElement('p');
  note.className = 'note';
  note.textContent = `This page could not be drawn: ${error.message}. The summary above is complete.`;
  document.getElementById('plots').append(note);
});
