// Change: materials, values inside their measured ranges, detail and drop; a new run is made of it.

import { el, si, spoken, NAMES } from './cards.js'

const VALUES = ['young', 'density', 'poisson', 'friction', 'restitution', 'loss'] // what can be changed here
const STEPS = 200 // of a slider
const LOOK_AGAIN = 1000 // [ms]

export class Change {
  constructor(viewer, run) {
    Object.assign(this, {viewer, run, parts: {}, detail: null, drop: null})
    const header = viewer.takes[0].header
    this.said = el('p', {class: 'bad', role: 'alert'})
    this.go = el('button', {class: 'do', disabled: true, onclick: () => this.start()}, 'Run again with this')
    this.state = el('p', {'aria-live': 'polite'})
    const detail = el('select', {'aria-label': 'detail', onchange: () => { this.detail = detail.value || null; this.look() }},
      el('option', {value: ''}, 'as it was'), ['draft', 'normal', 'fine'].map(d => el('option', {value: d}, d)))
    const drop = el('input', {type: 'number', min: 0, max: 100, step: .1, placeholder: 'as it was', 'aria-label': 'drop', oninput: () => {
      this.drop = drop.value === '' ? null : +drop.value
      this.look()
    }})
    this.content = el('div', {}, el('p', {}, 'Nothing here changes this run: a new one is made, and both can be compared.'),
      header.parts.map((part, k) => this.part(part, k, header)),
      el('label', {class: 'line'}, 'detail', detail), el('label', {class: 'line'}, 'drop, in sizes of the object', drop),
      this.go, this.said, this.state)
  }

  part(part, k, header) {
    const values = el('div', {})
    const choice = el('select', {'aria-label': `material of ${spoken(part.name)}`}, el('option', {value: part.material}, spoken(part.material)))
    choice.onfocus = choice.onpointerdown = () => this.fill(choice, part.material)
    choice.onchange = () => {
      const same = choice.value === part.material
      if (same) delete this.parts[k]; else this.parts[k] = {material: choice.value}
      values.hidden = !same
      this.look()
    }
    for (const name of VALUES) if (part.values[name]) values.append(this.slider(part, k, name))
    return el('details', {class: 'edit'}, el('summary', {}, el('b', {}, spoken(part.name)), ` of ${spoken(header.objects[part.object].name)}: ${spoken(part.material)}`),
      el('label', {class: 'line'}, 'material', choice), values)
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
    return el('label', {class: 'line'}, (NAMES[name] ?? name).split(' ').at(-1), input, said)
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

  look() { this.go.disabled = !Object.keys(this.parts).length && this.detail === null && this.drop === null }

  async start() {
    this.go.disabled = true
    const asked = {run: this.run, parts: this.parts}
    if (this.detail) asked.detail = this.detail
    if (this.drop !== null) asked.drop = this.drop
    const answer = await post('/jobs/change', asked)
    this.said.textContent = answer.error ?? ''
    if (answer.error) { this.look(); return }
    this.watch(answer.id, answer.name)
  }

  async watch(id, name) {
    const {jobs} = await fetch('/jobs').then(answer => answer.json()), job = jobs.find(j => j.id === id)
    if (!job || job.state === 'finished') {
      this.state.replaceChildren(`${name} is done. `, el('a', {href: `/view/${encodeURIComponent(this.run)}/${encodeURIComponent(name)}`}, 'Compare both'))
      return
    }
    this.state.textContent = `${name}: ${job.state} ${job.error || current(job)}`
    if (job.state === 'waiting' || job.state === 'running') setTimeout(() => this.watch(id, name), LOOK_AGAIN)
  }
}

const current = job => Object.entries(job.verbs).filter(([, share]) => share > 0).map(([verb, share]) => `${verb} ${Math.round(100 * share)} %`).at(-1) ?? ''

// Send an order to the server; foreign pages cannot send this header.
export async function post(path, asked) {
  const answer = await fetch(path, {method: 'POST', headers: {'X-Corporeal': '1'}, body: JSON.stringify(asked)})
  return answer.json()
}
