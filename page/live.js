// The page of seastitch-page. Text from the vehicle becomes text of elements, never HTML.
'use strict';
(() => {
  const kSilentMs = 4000;  // a state comes once a second
  const kRetryMs = 2000;
  const find = (name) => document.querySelector(`[data-live=${name}]`);
  const say = (name, text) => (find(name).textContent = text);
  let heardMs = 0, shownMap = 0, loadingMap = false;
  let trail = [];  // north and east in turn, since the map was made

  const element = (tag, text) => {
    const made = document.createElement(tag);
    made.textContent = text;
    return made;
  };
  const row = (cells) => {
    const made = document.createElement('tr');
    made.append(...cells.map((cell) => element('td', cell)));
    return made;
  };
  const metres = (value, digits = 1) => (value === null ? '\u2013' : `${value.toFixed(digits)} m`);
  const clock = (utime) => new Date(utime / 1000).toISOString().slice(0, 19).replace('T', ' ') + ' UTC';
  const span = (seconds) => `${Math.floor(seconds / 3600)} h ${Math.floor(seconds / 60) % 60} min`;

  function showBanner(kind, text) {
    find('banner').className = `banner ${kind}`;
    say('banner', text);
  }

  function showHead({status}) {
    const dive = status.dive;
    const since = dive && dive.start_utime > 0
        ? `dive since ${clock(dive.start_utime)} (${span((status.utime - dive.start_utime) / 1e6)})`
        : dive ? 'recording' : 'no dive is recorded: the logger is not heard';
    say('head', `${clock(status.utime)} \u00b7 ${since}`);
    say('disk', dive && dive.disk_free_mb >= 0 ? `${(dive.disk_free_mb / 1000).toFixed(1)} GB` : '\u2013');
  }

  function showPlace({status, map, navigated}) {
    const at = status.vehicle;
    say('place', at ? `\u00b1 ${metres(at.sigma_m)}` : 'not known');
    say('depth', at ? metres(at.depth_m) : '\u2013');
    say('submaps', `${map.submaps}, ${map.closures_used}`);
    const rows = [];
    if (at) rows.push(row(['corrected (NAV_CORRECTED)', metres(at.north_m), metres(at.east_m), metres(at.sigma_m)]));
    if (navigated)
      rows.push(row(['dead reckoning (NAV)', metres(navigated.north_m), metres(navigated.east_m), metres(navigated.sigma_m)]));
    find('navigation').replaceChildren(...rows);
    if (!at) return;
    trail.push(at.north_m, at.east_m);
    if (trail.length > 8000) trail = trail.slice(4000);
    seastitchViewer.showVehicle({
      ...at, trail, navigated: navigated ? [navigated.north_m, navigated.east_m] : null});
  }

  function showProcesses({status}) {
    const rates = (process) => Object.entries(process.rates_hz || {})
        .map(([name, hz]) => `${name} ${hz.toFixed(hz < 9.95 ? 1 : 0)}`).join(', ');
    find('processes').replaceChildren(...status.processes.map((process) => row([
      process.name + (process.runs_twice ? ' (runs twice)' : ''), process.state, rates(process),
      String(process.drops ?? '\u2013'), process.text || 'not heard'])));
    const faults = [];
    for (const process of status.processes)
      for (const fault of process.conditions || []) {
        const item = document.createElement('li');
        item.append(element('b', `${process.name}: ${fault.sentence}`), document.createElement('br'), fault.remedy);
        faults.push(item);
      }
    if (faults.length === 0) faults.push(element('li', 'Nothing: no process reports a fault.'));
    find('faults').replaceChildren(...faults);
    const worst = status.processes.map((process) => process.state);
    if (status.ok) showBanner('good', 'All processes are well.');
    else if (worst.includes('lost') || worst.includes('silent'))
      showBanner('bad', 'A sensor, the navigation or a process is lost: see "What to do" and "Processes".');
    else showBanner('part', 'A process starts or reports a fault: see "What to do".');
    const mapper = status.processes.find((process) => process.name === 'mapper');
    if (mapper && mapper.version) say('version', `Seastitch ${mapper.version}`);
  }

  async function loadMap(version) {
    if (loadingMap || version === shownMap) return;
    loadingMap = true;
    try {
      const answer = await fetch('map.json');
      if (answer.status !== 200) return;
      const map = await answer.json();
      trail = trail.slice(-20);  // the map is some seconds old
      await seastitchViewer.show(map);
      find('no-map').hidden = true;
      shownMap = version;
    } catch (error) {
      say('no-map', `The map cannot be drawn here (${error.message}).`);
    } finally {
      loadingMap = false;
    }
  }

  function follow() {
    const events = new EventSource('events');
    events.onmessage = (event) => {
      const state = JSON.parse(event.data);
      heardMs = Date.now();
      showHead(state);
      showPlace(state);
      showProcesses(state);
      loadMap(state.map.version);
      document.body.dataset.heard = 'yes';
    };
    events.onerror = () => {
      events.close();
      setTimeout(follow, kRetryMs);
    };
  }

  setInterval(() => {
    if (Date.now() - heardMs > kSilentMs)
      showBanner('bad', 'Nothing is heard of the vehicle: its page does not answer, or has eight browsers already.');
  }, 1000);
  follow();
})();
