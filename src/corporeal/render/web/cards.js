// What is said beside the picture: numbers, cards of parts, warnings, colour keys. All text goes in as text.

const PREFIXES = [[1e9, 'G'], [1e6, 'M'], [1e3, 'k'], [1, ''], [1e-3, 'm'], [1e-6, 'µ']]
export const NAMES = {
  young_pa: 'Young’s modulus E', poisson: 'Poisson’s ratio ν', density: 'density ρ', yield_stress: 'yield stress σ_y',
  friction_angle: 'friction angle φ', cohesion: 'cohesion c', hardening: 'hardening modulus H', friction: 'surface friction μ',
  restitution: 'restitution e', loss: 'loss factor η', shell_thickness: 'wall thickness',
}
const ANSWERED = {annotation: 'your annotation', recording: 'a recorded answer', model: 'a model', metadata: 'metadata of the file',
  unknown: 'unknown: neutral material'}

// An element with properties and children; strings become text nodes.
export function el(tag, props = {}, ...children) {
  const made = document.createElement(tag)
  for (const [key, value] of Object.entries(props)) {
    if (key.startsWith('on')) made[key] = value
    else if (key === 'style') Object.assign(made.style, value)
    else if (value === true) made.setAttribute(key, '')
    else if (value !== false && value != null) made.setAttribute(key, value)
  }
  made.append(...children.flat().filter(child => child != null))
  return made
}

export function si(value, unit) {
  if (value == null || Number.isNaN(value)) return '–'
  if (unit === 'kg') return Math.abs(value) >= .9995 ? `${+value.toPrecision(4)} kg` : si(1e3 * value, 'g')
  if (unit === 'rad') return `${+(value * 180 / Math.PI).toPrecision(3)}°`
  const bare = unit === '-' ? '' : unit
  if (!['Pa', 'm', 'N', 'm/s', 's'].includes(unit) || value === 0) return `${+value.toPrecision(4)} ${bare}`.trim()
  const [size, prefix] = PREFIXES.find(([s]) => Math.abs(value) >= .9995 * s) ?? PREFIXES.at(-1)
  return `${+(value / size).toPrecision(3)} ${prefix}${bare}`
}

export const spoken = name => String(name ?? '').replaceAll('_', ' ')

// ---------------------------------------------------------------- a part's card

export function card(part, header) {
  const s = part.simulated, alternatives = part.alternatives.map(a => `${spoken(a.material)} (${Math.round(100 * a.probability)} %)`)
  return el('div', {class: 'card'},
    el('h3', {}, spoken(part.name), el('small', {}, ` of ${spoken(header.objects[part.object].name)}`)),
    el('p', {class: 'material'}, el('b', {}, spoken(part.material)), ` · ${spoken(part.law)} · ${built(part.structure)}`),
    part.mass_kg == null ? null : el('p', {}, `Mass ${si(part.mass_kg, 'kg')} in the scene`,
      Math.abs(part.scale - 1) > 1e-3 ? `, ${si(part.real_mass_kg, 'kg')} of the real object` : ''),
    el('p', {class: 'note'}, simulated(s)),
    el('p', {}, el('small', {}, `${part.reason} Said by ${ANSWERED[part.answered_by] ?? part.answered_by}; ${Math.round(100 * part.margin)} % ahead of the next guess.`,
      alternatives.length ? ` Alternatives: ${alternatives.join(', ')}.` : '')),
    ...Object.entries(part.values).map(([name, value]) => valueRow(name, value)),
    el('p', {}, el('small', {}, `${part.structure.reason} ${part.fill}`)))
}

function built(structure) {
  return structure.contents ? `${structure.kind} with ${spoken(structure.contents)}` : structure.kind
}

function simulated(s) {
  if (s.kind === 'rigid') return [el('b', {}, 'Simulated as a rigid body. '), s.reason]
  const ratio = s.simulated_young_pa / s.young_pa, same = Math.abs(ratio - 1) < 1e-3
  return [`E real `, el('b', {}, si(s.young_pa, 'Pa')), ', simulated ', el('b', {}, si(s.simulated_young_pa, 'Pa')),
    same ? ' (as measured). ' : ` (${+ratio.toPrecision(2)} ×). `, s.reason]
}

function valueRow(name, {value, range, unit, place, scale, chosen_by, reason, source}) {
  return el('div', {class: 'value'},
    el('div', {class: 'row'}, el('span', {}, NAMES[name] ?? spoken(name)), el('b', {}, si(value, unit))),
    el('div', {class: 'range'}, el('small', {}, si(range[0], unit)),
      el('div', {class: 'bar', title: `${scale} scale`}, el('i', {style: {left: `${100 * Math.min(Math.max(place, 0), 1)}%`}})),
      el('small', {}, si(range[1], unit))),
    el('details', {}, el('summary', {}, `${chosen_by}: ${reason}`), el('small', {}, `Source of the range: ${source}`)))
}

// ---------------------------------------------------------------- the key of the colours

export function key(stage) {
  const {header} = stage.take, by = stage.by, panel = header.panels[by]
  if (by === 'itself') return null
  if (by === 'stress') return scaleKey(header, 'von Mises stress', 0, stage.tops.stress || stage.topOf('stress'), 'Pa')
  if (by === 'speed') return scaleKey(header, 'speed', 0, stage.tops.speed || stage.topOf('speed'), 'm/s')
  if (panel.values) return scaleKey(header, panel.title, Math.min(...panel.values), Math.max(...panel.values), panel.unit, panel.log)
  const seen = new Map(panel.labels.map((label, k) => [label, panel.colours[k]]))
  return el('div', {}, el('b', {}, panel.title),
    [...seen].map(([label, colour]) => el('div', {class: 'swatch'}, el('i', {style: {background: colour}}), spoken(label))))
}

function scaleKey(header, title, low, high, unit, log = false) {
  const stops = header.ramp.map(c => `rgb(${c.join(',')})`).join(',')
  const middle = log ? Math.sqrt(low * high) : (low + high) / 2
  const marks = high > low ? [low, middle, high] : [low]
  return el('div', {class: 'scale'}, el('b', {}, `${title}${log ? ' (log)' : ''}`),
    el('div', {class: 'gradient', style: {background: `linear-gradient(90deg,${stops})`}}),
    el('div', {class: 'row'}, marks.map(v => el('span', {}, si(v, unit)))))
}

// ---------------------------------------------------------------- the audit

const NUMBERS = {
  momentum_residual: 'momentum residual, relative', mechanical_growth: 'growth of kinetic and elastic energy, relative',
  max_penetration_dx: 'largest penetration [grid cells]', max_penetration_m: 'largest penetration [m]', steps: 'time steps',
  dt_min: 'smallest step [s]', dt_max: 'largest step [s]', nan_count: 'values that are not finite',
  particles_out_of_domain: 'particles outside the domain',
}

export function auditOf(header, openPart) {
  const audit = header.audit
  if (!audit) {
    return el('p', {}, header.video ? 'The audit comes with the report, which this run does not have yet.'
      : 'Nothing has been simulated yet: the audit says afterwards what energy, momentum and contacts did.')
  }
  const listed = sentences => el('ul', {}, sentences.map(w => el('li', {}, w.text, ' ',
    w.parts.map(k => el('button', {class: 'link', onclick: () => openPart(k)}, `show ${spoken(header.parts[k].name)}`)))))
  return el('div', {},
    audit.grave.length ? el('div', {class: 'grave'}, el('b', {}, 'Contradicts the measured values'), listed(audit.grave)) : null,
    audit.warnings.length ? el('div', {class: 'warn'}, el('b', {}, 'Limitations found by the audit'), listed(audit.warnings)) : null,
    audit.grave.length + audit.warnings.length ? null : el('p', {class: 'good'}, 'The audit found no violations.'),
    audit.expectations.length ? el('h3', {}, 'Expected outcomes of this scene') : null,
    audit.expectations.map(e => el('p', {class: e.met ? 'yes' : 'no'}, `${e.met ? '✓' : '✗'} ${e.sentence} `,
      el('small', {}, `measured ${e.value}, expected ${e.target}`))),
    el('h3', {}, 'Audit'),
    table(Object.entries(audit.numbers).map(([k, v]) => [NUMBERS[k] ?? spoken(k), typeof v === 'number' ? +v.toPrecision(3) : v])),
    el('h3', {}, 'Settings and time'),
    table([...Object.entries(audit.settings), ...Object.entries(audit.seconds).map(([k, v]) => [k, `${v.toFixed(1)} s`])]),
    el('h3', {}, 'Credits'),
    header.credits.length ? el('ul', {}, header.credits.map(c => el('li', {}, c))) : el('p', {}, 'none stated in the files'))
}

export function table(rows, head = null) {
  return el('table', {}, head ? el('tr', {}, head.map(h => el('th', {}, h))) : null,
    rows.map(cells => el('tr', {}, cells.map(c => el('td', {}, c instanceof Node ? c : String(c))))))
}

// ---------------------------------------------------------------- two runs

// A part's name, and whose it is where others are called so too.
const called = (header, part) => header.parts.filter(p => p.name === part.name).length > 1
  ? `${spoken(part.name)} of ${spoken(header.objects[part.object].name)}` : spoken(part.name)

// What differs between the parts of two runs, as rows.
export function differences(a, b) {
  const rows = [], ofB = new Map(b.parts.map(p => [`${b.objects[p.object].name}/${p.name}`, p]))
  for (const part of a.parts) {
    const name = `${a.objects[part.object].name}/${part.name}`, other = ofB.get(name), said = called(a, part)
    ofB.delete(name)
    if (!other) { rows.push([said, 'part', 'present', 'absent']); continue }
    if (part.material !== other.material) rows.push([said, 'material', spoken(part.material), spoken(other.material)])
    for (const key of Object.keys(part.values)) {
      const x = part.values[key], y = other.values[key]
      if (y && Math.abs(x.value - y.value) > 1e-6 * Math.abs(x.value)) rows.push([said, NAMES[key] ?? spoken(key), si(x.value, x.unit), si(y.value, y.unit)])
    }
    const s = part.simulated, t = other.simulated
    if (s.kind !== t.kind) rows.push([said, 'simulated as', s.kind, t.kind])
    else if (s.kind !== 'rigid' && Math.abs(s.simulated_young_pa - t.simulated_young_pa) > 1e-3 * s.simulated_young_pa) rows.push([said, 'E simulated', si(s.simulated_young_pa, 'Pa'), si(t.simulated_young_pa, 'Pa')])
  }
  for (const part of ofB.values()) rows.push([spoken(part.name), 'part', 'absent', 'present'])
  const fast = o => (o?.velocity ?? []).map(v => +v.toPrecision(3)).join(', ')
  a.objects.forEach((one, k) => {
    const other = b.objects[k]
    if (other && fast(one) !== fast(other)) rows.push([spoken(one.name), 'initial velocity [m/s]', fast(one), fast(other)])
    if (other && Math.abs(one.height - other.height) > 1e-4) rows.push([spoken(one.name), 'height of its underside', si(one.height, 'm'), si(other.height, 'm')])
  })
  for (const part of a.parts) {
    const other = b.parts.find(p => p.name === part.name && b.objects[p.object].name === a.objects[part.object].name)
    if (other?.mass_kg && Math.abs(part.mass_kg - other.mass_kg) > 1e-3 * part.mass_kg) rows.push([called(a, part), 'mass', si(part.mass_kg, 'kg'), si(other.mass_kg, 'kg')])
  }
  for (const [name, unit] of [['cell', 'm'], ['particles', '-'], ['duration', 's']]) {
    if (a[name] !== b[name]) rows.push(['scene', name, si(a[name], unit), si(b[name], unit)])
  }
  return rows.map((row, k) => k && rows[k - 1][0] === row[0] ? ['', ...row.slice(1)] : row)
}
