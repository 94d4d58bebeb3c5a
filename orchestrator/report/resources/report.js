"use strict";
// The page of runs.
(() => {
  const { data, make, timeOf, dark, still } = page;
  const FIRST = 8; // panels that are drawn before the page counts as ready

  const begin = async () => {
    Bokeh.set_log_level?.("error");
    const host = document.getElementById("signals"), times = await Promise.all(data.runs.map(timeOf));
    if (!data.runs.some((run) => run.points)) { host.append("No point was recorded."); return; }
    const explorer = new Explorer(data.runs, host, times);
    document.dispatchEvent(new CustomEvent("explore", { detail: explorer }));
    for (const told of data.panels) explorer.add(told);
    if (!data.panels.length) explorer.show(data.signals.slice(0, 6).map((one) => one.name), false);
    explorer.at(explorer.now);
    for (const button of document.querySelectorAll("[data-requirement]")) {
      const run = Number(button.dataset.run), requirement = data.runs[run].requirements[Number(button.dataset.requirement)];
      button.addEventListener("click", async () => {
        const panel = explorer.show(requirement.signals, true, [{ ...requirement, run }]);
        explorer.at(requirement.time);
        if (!panel) return;
        await panel.ready;
        panel.node.scrollIntoView({ behavior: still.matches ? "auto" : "smooth", block: "center" });
      });
    }
    for (const change of [dark, matchMedia("print")]) change.addEventListener("change", () => explorer.shade());
    const part = document.getElementById("trains");
    for (const [k, run] of data.runs.entries()) if (run.trains.length && run.points) {
      const own = make("div");
      if (data.runs.length > 1) own.append(make("h3", {}, run.name));
      part.hidden = false; part.append(own);
      explorer.trains.push(new Trains(k, own, explorer));
      await explorer.trains.at(-1).load();
    }
    if (part.hidden) document.querySelector('nav a[href="#trains"]')?.remove();
    await Promise.all(explorer.panels.slice(0, FIRST).map((panel) => panel.ready));
    explorer.queue.then(() => (document.documentElement.dataset.whole = "true"));
  };
  begin().then(() => (document.documentElement.dataset.ready = "true"));
})();
