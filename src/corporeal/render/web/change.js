// Change: materials, values inside their measured ranges, how objects begin, detail; a new run is made of it.

import { el, si, spoken, NAMES } from './cards.js'

const VALUES = ['young_pa', 'density', 'poisson', 'friction', 'restitution', 'loss'] // what can be changed here
const STEPS = 200 // of a slider
const LOOK_AGAIN = 1000 // [ms]
const FEW = 3 // parts that are shown open
const AXES = ['x', 'y', 'z, up']

export class Change {
  constructor(viewer, run) {
    Object.assign(this, {viewer, run, parts: {}, objects: {}, detail: null, drop: null})
    const header = viewer.takes[0].header
    this.said = el('p', {class: 'bad', role: 'alert'})
    this.go = el('button', {class: 'do', disabled: true, onclick: () => this.start()}, 'Run again with this')
    this.state = el('p', {'aria-live': 'polite'})
    const detail = el('select', {'aria-label': 'detail', onchange: () => { this.detail = detail.value || null; this.look() }},
      el('option', {value: ''}, 'as it was'), ['draft', 'normal', 'fine'].map(d => el('option', {value: d}, d)))
    const drop = this.number('raise everything, in sizes of each object', 0, 100, value => { this.drop = value })
    this.begins = el('div', {}, el('p', {class: 'soft'}, 'Reading how it began …'))
    this.content = el('div', {}, el('p', {}, 'Nothing here changes this run: a new one is made, and both can be compared.'),
      el('h3', {}, 'What it is made of'), header.parts.map((part, k) => this.part(part, k, header)),
      el('h3', {}, 'How it begins'), drop.row, this.begins,
      el('h3', {}, 'How finely'), el('label', {class: 'line'}, 'detail', detail),
      this.go, this.why = el('p', {class: 'hint'}, 'Change something above first.'), this.said, this.state)
    this.ask(header, drop, detail)
  }

  // A number field with its words; empty: as it was.
  number(words, low, high, changed) {
    const input = el('input', {type: 'number', min: low, max: high, step: 'any', 'aria-label': words, oninput: () => {
      changed(input.value === '' ? null : +input.value)
      this.look()
    }})
    return {input, row: el('label', {class: 'line'}, words, input)}
  }

  // How the run began stands in its fields; what is left alone stays so.
  async ask(header, drop, detail) {
    const asked = await fetch(`/asked/${encodeURIComponent(this.run)}`).then(answer => answer.json())
    drop.input.placeholder = String(asked.drop)
    detail.options[0].textContent = `as it was (${asked.detail})`
    this.begins.replaceChildren(...asked.lift.map((lift, k) => this.beginning(header.objects[k], k, lift, asked.velocity[k], asked.lift.length <= FEW)))
  }

  beginning(object, k, lift, velocity, open) {
    const change = () => this.objects[k] ??= {}
    const tidy = () => { if (this.objects[k] && !Object.keys(this.objects[k]).length) delete this.objects[k] }
    const raised = this.number('raised by [m]', 0, 100, value => { if (value === null) delete change().lift; else change().lift = value; tidy() })
    raised.input.placeholder = String(lift)
    const fields = velocity.map((v, axis) => {
      const field = el('input', {type: 'number', step: 'any', placeholder: String(+v.toPrecision(4)), 'aria-label': `velocity of ${spoken(object.name)}, ${AXES[axis]}`,
        title: AXES[axis], oninput: () => {
          if (fields.every(f => f.value === '')) delete change().velocity
          else change().velocity = fields.map((f, a) => f.value === '' ? velocity[a] : +f.value)
          tidy()
          this.look()
        }})
      return field
    })
    return el('details', {class: 'edit', open}, el('summary', {}, el('b', {}, spoken(object.name)), ' height and velocity'), raised.row,
      el('div', {}, 'velocity [m/s]: x, y, z (up)'), el('div', {class: 'three'}, fields))
  }

  part(part, k, header) {
    const values = el('div', {})
    const other = el('p', {class: 'hint', hidden: true})
    const choice = el('select', {'aria-label': `material of ${spoken(part.name)}`}, el('option', {value: part.material}, spoken(part.material)))
    choice.onfocus = choice.onpointerdown = () => this.fill(choice, part.material)
    choice.onchange = () => {
      const same = choice.value === part.material
      if (same) delete this.parts[k]; else this.parts[k] = {material: choice.value}
      values.hidden = !same
      other.hidden = same
      other.textContent = `Of ${spoken(choice.value)} the usual values are taken; the new run can be changed again.`
      this.look()
    }
    for (const name of VALUES) if (part.values[name]) values.append(this.slider(part, k, name))
    return el('details', {class: 'edit', open: header.parts.length <= FEW}, el('summary', {}, el('b', {}, spoken(part.name)), ` of ${spoken(header.objects[part.object].name)}: ${spoken(part.material)}`),
      el('label', {class: 'line'}, 'material', choice), other, values)
  }

  // Ranges of an order of magnitude and more are divided on a logarithmic scale, as the library does.
  slider(part, k, name) {
    const {value, range: [low, high], unit, scale} = part.values[name], log = scale === 'logarithmic' && low > 0
    const at = x => log ? low * (high / low) ** x : low + (high - low) * x
    const share = high > low ? (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low)) : .5
    const said = el('b', {}, si(value, unit))
    const input = el('input', {type: 'range', min: 0, max: STEPS, value: Math.round(STEPS * share), disabled: high <= low, 'aria-label': `${name} of ${part.name}`, oninput: () => {
      const chosen = at(input.value / STEPS), change = this.parts[k] ??= {material: part.material, values: {}}
      change.values ??= {}
      change.values[name] = chosen
      said.textContent = si(chosen, unit)
      this.look()
    }})
    return el('label', {class: 'line slide'}, el('span', {}, NAMES[name] ?? name), input, said)
  }

  async fill(choice, own) {
    if (choice.options.length > 1) return
    this.materials ??= fetch('/materials').then(answer => answer.json())
    const {materials} = await this.materials
    if (choice.options.length > 1) return
    const groups = [...new Set(materials.map(m => m.group))].sort()
    choice.replaceChildren(...groups.map(g => el('optgroup', {label: g || 'other'},
      materials.filter(m => m.group === g).map(m => el('option', {value: m.name, selected: m.name === own}, spoken(m.name))))))
  }

  look() {
    this.go.disabled = ![this.parts, this.objects].some(changes => Object.keys(changes).length) && this.detail === null && this.drop === null
    this.why.hidden = !this.go.disabled
  }

  async start() {
    this.go.disabled = true
    const asked = {run: this.run, parts: this.parts, objects: this.objects}
    if (this.detail) asked.detail = this.detail
    if (this.drop !== null) asked.drop = this.drop
    const answer = await post('/jobs/change', asked)
    this.said.textContent = answer.error ?? ''
    if (answer.error) { this.look(); return }
    this.watch(answer.id, answer.name)
  }

  watch(id, name) {
    this.go.hidden = true
    follow(id, this.state, `/view/${encodeURIComponent(this.run)}/${encodeURIComponent(name)}`, 'Compare both', () => { this.go.hidden = false; this.look() })
  }
}

// Show how far a job is until it ends, then a way to what it made.
export async function follow(id, holder, address, words, ended = () => {}) {
  const {jobs} = await fetch('/jobs').then(answer => answer.json()), job = jobs.find(j => j.id === id)
  const again = () => setTimeout(() => follow(id, holder, address, words, ended), LOOK_AGAIN)
  if (!job || job.state === 'finished') {
    holder.replaceChildren(el('b', {}, `${job?.name ?? 'The run'} is done. `), el('a', {class: 'do', href: address}, words))
    return ended()
  }
  const bars = Object.entries(job.verbs).map(([verb, share]) => el('label', {class: 'line'}, verb, el('progress', {max: 1, value: share})))
  holder.replaceChildren(el('p', {}, el('b', {}, job.name), `: ${job.state}${job.words ? ` · ${job.words}` : ''}`), ...bars,
    job.error ? el('p', {class: 'bad'}, job.error) : null ?? '', el('p', {}, el('a', {href: '/home'}, 'The queue, to stop it'), ' · it goes on if you leave this page'))
  if (job.state === 'waiting' || job.state === 'running') again()
  else ended()
}

// Send an order to the server; foreign pages cannot send this header.
export async function post(path, asked) {
  const answer = await fetch(path, {method: 'POST', headers: {'X-Corporeal': '1'}, body: JSON.stringify(asked)})
  return answer.json()
}
