// The list of runs; where the server may work, uploads and the queue.

import { post } from './change.js'
import { el, spoken } from './cards.js'

const LOOK_AGAIN = 1000 // [ms]
const root = document.getElementById('home'), picked = new Set()
const address = (...names) => `/view/${names.map(encodeURIComponent).join('/')}`
let seen = ''
const SAYS = {reconstruct: 'a model is trained on the pictures', assemble: 'the files become one scene in metres', describe: 'every object and part is recognised',
  segment: 'the parts are found on the surfaces', ground: 'materials get numbers from measured ranges', fill: 'surfaces are filled with matter',
  simulate: 'it moves', video: 'a video is drawn', report: 'the report is written'}

// ---------------------------------------------------------------- runs

const compareButton = el('button', {class: 'do', hidden: true, onclick: () => { location.href = address(...picked) }})

function compare() {
  const names = [...picked]
  compareButton.hidden = names.length < 2
  compareButton.disabled = names.length !== 2
  compareButton.textContent = names.length === 2 ? `Compare ${names.join(' and ')}` : 'Choose two runs to compare'
}

function card(run) {
  const box = el('input', {type: 'checkbox', 'aria-label': `compare ${run.name}`, checked: picked.has(run.name), onchange: () => {
    if (box.checked) picked.add(run.name); else picked.delete(run.name)
    compare()
  }})
  const image = run.picture ? el('img', {src: `/picture/${encodeURIComponent(run.name)}`, alt: `a frame of ${run.name}`, loading: 'lazy'})
    : el('div', {class: 'blank'}, run.shown ? 'not simulated yet' : run.state || 'not begun')
  return el('div', {class: 'run'}, run.shown ? el('a', {href: address(run.name)}, image) : image,
    el('div', {class: 'words'}, el('b', {}, run.name), el('p', {class: 'soft'}, [run.input, spoken(run.detail), run.state].filter(Boolean).join(' · ')),
      run.error ? el('p', {class: 'bad'}, run.error) : null,
      el('div', {class: 'links'}, run.shown ? el('a', {href: address(run.name)}, 'Look') : null,
        run.report ? el('a', {href: `/report/${encodeURIComponent(run.name)}`}, 'Report') : null,
        run.shown ? el('label', {class: 'pick'}, box, ' compare') : null)))
}

const list = el('div', {class: 'runs'}), none = el('p', {class: 'soft', hidden: true}, 'No runs yet. Drop a file above, or try the first showcase scene: corporeal demo')

// ---------------------------------------------------------------- uploads

const said = el('div', {class: 'bad', role: 'alert'}), progress = el('p', {class: 'soft', 'aria-live': 'polite'}), coming = el('progress', {max: 1, value: 0, hidden: true})
const detail = el('select', {'aria-label': 'detail'}, ['draft', 'normal', 'fine'].map(d => el('option', {}, d)))
const raise = el('select', {'aria-label': 'how it begins'}, [[0, 'as in the file'], [.5, 'raised by half its size'], [1, 'raised by its size']].map(([size, words]) =>
  el('option', {value: size, selected: size === .5}, words)))
const first = el('input', {type: 'checkbox', checked: true})
const chooser = el('input', {type: 'file', hidden: true, accept: '.glb,.ply,.zip', onchange: () => take(chooser.files)})
const drop = el('div', {class: 'drop'}, el('p', {}, 'Drop a GLB, a Gaussian splat (PLY) or a zip of photographs here, or ',
  el('button', {onclick: () => chooser.click()}, 'choose a file')), chooser, coming,
  el('p', {class: 'soft'}, el('label', {}, 'it begins ', raise), '  ', el('label', {}, 'detail ', detail), '  ', el('label', {}, first, ' stop to look at the materials first')),
  el('p', {class: 'soft'}, 'At most 1 GB. The file stays on the machine that this page comes from.'), progress, said)
for (const kind of ['dragenter', 'dragover']) drop.addEventListener(kind, event => { event.preventDefault(); drop.classList.add('over') })
for (const kind of ['dragleave', 'drop']) drop.addEventListener(kind, event => { event.preventDefault(); drop.classList.remove('over') })
drop.addEventListener('drop', event => take(event.dataTransfer.files))

// XMLHttpRequest and not fetch: it says how much has gone.
function sent(file) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest()
    request.open('PUT', '/files')
    request.setRequestHeader('X-Corporeal', '1')
    request.upload.onprogress = event => { if (!event.lengthComputable) return
      coming.value = event.loaded / event.total
      progress.textContent = event.loaded < event.total ? `${file.name}: ${Math.round(100 * coming.value)} % sent` : `${file.name}: sent, being looked at …`
    }
    request.onload = () => { try { resolve(JSON.parse(request.responseText)) } catch { reject(new Error(`The server answered ${request.status}.`)) } }
    request.onerror = () => reject(new Error('The file did not arrive.'))
    request.send(file)
  })
}

async function take(files) {
  said.replaceChildren()
  for (const file of files) {
    coming.hidden = false
    try {
      const upload = await sent(file)
      const job = upload.error ? upload : await post('/jobs/start', {upload: upload.id, name: file.name.replace(/\.[^.]*$/, ''), detail: detail.value, drop: +raise.value, first: first.checked})
      if (job.error) said.append(el('p', {}, `${file.name}: ${job.error}`))
    } catch (error) { said.append(el('p', {}, `${file.name}: ${error.message}`)) }
    coming.hidden = true
    progress.textContent = ''
  }
  chooser.value = ''
  await refresh()
}

// ---------------------------------------------------------------- the queue

const queue = el('div', {'aria-live': 'polite'})

async function order(path, id) {
  const answer = await post(path, {id})
  said.replaceChildren(answer.error ?? '')
  await refresh()
}

function row(job) {
  const over = ['finished', 'failed', 'stopped'].includes(job.state), partly = job.state === 'finished' && job.until !== 'report'
  const button = !over ? el('button', {onclick: () => order('/jobs/stop', job.id)}, 'Stop')
    : job.state !== 'finished' || partly ? el('button', {onclick: () => order('/jobs/go-on', job.id)}, partly ? 'Simulate it as it is' : 'Go on') : null
  return el('div', {class: 'job'}, el('div', {class: 'row'}, el('b', {}, job.name), el('span', {class: 'soft'}, partly ? 'materials are found, not simulated yet' : job.state === 'running' && !job.words ? 'running · starting' : job.state, job.words ? ` · ${job.words}` : ''),
    job.state === 'finished' ? el('a', {href: address(job.name)}, partly ? 'see what it is taken for' : 'Look') : null, button),
  job.error ? el('p', {class: 'bad'}, job.error) : null,
  el('div', {class: 'verbs'}, Object.entries(job.verbs).map(([verb, share]) => el('label', {title: SAYS[verb] ?? ''}, verb, el('progress', {max: 1, value: share})))))
}

// ---------------------------------------------------------------- the page

export async function refresh() {
  const {runs, works} = await fetch('/runs').then(answer => answer.json())
  const {jobs} = works ? await fetch('/jobs').then(answer => answer.json()) : {jobs: []}
  upper.hidden = !works
  const now = JSON.stringify(runs)
  if (now !== seen) { list.replaceChildren(...runs.map(card)); seen = now }
  none.hidden = runs.length > 0
  queue.replaceChildren(...jobs.map(row))
  queueTitle.hidden = !jobs.length
  return jobs.some(job => job.state === 'running' || job.state === 'waiting')
}

const queueTitle = el('h2', {hidden: true}, 'Queue'), upper = el('div', {hidden: true}, drop, queueTitle, queue)
root.replaceChildren(el('h1', {}, 'Runs'), upper, el('h2', {}, 'All runs'), compareButton, list, none)

async function watch() {
  let busy = false
  try { busy = await refresh() } catch { said.replaceChildren('The server does not answer. Was it ended?') }
  setTimeout(watch, busy ? LOOK_AGAIN : 4 * LOOK_AGAIN)
}
await watch()
window.home = {ready: true}
