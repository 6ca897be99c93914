// The page: draws what the window shows at once, the other figures one after another when there is time, and all again when
// its width, the theme or the choice of view changes.

{
  const data = JSON.parse(document.getElementById("data").textContent);
  const root = document.documentElement;
  const figures = [...document.querySelectorAll("figure[data-figure]")];
  const config = {
    displaylogo: false, responsive: false, showTips: false,
    modeBarButtons: [["zoom2d", "pan2d", "autoScale2d", "resetScale2d", "toImage"]],
    toImageButtonOptions: { format: "svg", filename: "trihedron-figure" },
  };

  const COLOURS = ["paper", "sheet", "ink", "muted", "line", "grid", "shade", "link", "blue", "vermillion", "green", "purple",
    "correlation-minus", "correlation-zero", "correlation-plus", "track-start", "track-end"];
  function colours() {
    const style = getComputedStyle(root);
    const read = (name) => style.getPropertyValue(`--${name}`).trim();
    return { ...Object.fromEntries(COLOURS.map((name) => [name, full(read(name))])), sans: read("sans") };
  }
  /** "#fff" as "#ffffff": minifiers shorten colours, and the figures read the red, green and blue from six digits. */
  function full(hex) {
    return hex.length === 4 ? `#${[...hex.slice(1)].map((digit) => digit + digit).join("")}` : hex;
  }

  const detail = () => document.querySelector('input[name="view"]:checked')?.value === "detail";

  function drawSpheres(figure) {
    const host = figure.querySelector(".spheres");
    figure.spheres ??= data.tracks.map((track, i) => new Sphere(host, track, i + 1));
    const colour = colours();
    for (const sphere of figure.spheres) sphere.draw(colour);
  }

  function drawPlot(figure, width) {
    const plot = figure.querySelector(".plot");
    const look = { width: width ?? plot.clientWidth, colour: colours(), detail: detail(), print: width !== undefined };
    const { traces, layout: bare } = FIGURES[figure.dataset.figure](data, look, figure.dataset);
    const layout = withRoomForLegend(bare, traces);
    plot.style.height = `${layout.height}px`;
    Plotly.react(plot, traces, layout, config);
  }

  function draw(figure, width) {
    figure.dataset.drawn = "true";
    if (figure.dataset.figure === "tracks") drawSpheres(figure);
    else drawPlot(figure, width);
  }

  const redraw = () => figures.filter((figure) => figure.dataset.drawn && !figure.hidden).forEach((figure) => draw(figure));

  // ---- When to draw

  const missing = () => figures.find((figure) => !figure.dataset.drawn && !figure.hidden);
  let isDrawing = false;
  /** Without waiting for the reader to scroll: whoever makes a picture or a copy of the page does not. */
  function drawMissing() {
    if (isDrawing || !missing()) return;
    isDrawing = true;
    // In a task for each, so that the page answers meanwhile.
    setTimeout(() => {
      isDrawing = false;
      const figure = missing();
      if (!figure) return;
      try { draw(figure); } finally { drawMissing(); }
    });
  }

  let lastWidth = innerWidth;
  addEventListener("resize", () => {
    if (innerWidth === lastWidth) return;
    lastWidth = innerWidth;
    requestAnimationFrame(redraw);
  });

  // ---- Theme

  const themeButton = document.getElementById("theme");
  function setTheme(theme) {
    root.dataset.theme = theme;
    themeButton.setAttribute("aria-pressed", String(theme === "dark"));
    themeButton.textContent = theme === "dark" ? "Light" : "Dark";
    redraw();
  }
  themeButton.addEventListener("click", () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", ({ matches }) => setTheme(matches ? "dark" : "light"));
  setTheme(root.dataset.theme);

  // ---- Choice of coefficients and of their view

  const choice = document.getElementById("coefficient-choice");
  function applyChoice() {
    const chosen = new Set([...choice.querySelectorAll('input[name="coefficient"]:checked')].map((input) => input.value));
    for (const figure of figures.filter(({ dataset }) => dataset.figure === "coefficient")) {
      figure.hidden = !chosen.has(figure.dataset.name);
    }
    drawMissing();
  }
  if (choice) {
    // After a reload the browser may restore ticked boxes.
    applyChoice();
    choice.addEventListener("change", () => { applyChoice(); redraw(); });
    document.getElementById("all-coefficients").addEventListener("click", () => {
      for (const input of choice.querySelectorAll('input[name="coefficient"]')) input.checked = true;
      applyChoice();
    });
  }

  // ---- Print: everything, on white, in the width of the paper

  const PAPER_WIDTH = 680;
  let themeOnScreen = null;
  addEventListener("beforeprint", () => {
    themeOnScreen = root.dataset.theme;
    root.dataset.theme = "light";
    for (const figure of figures) {
      figure.hidden = false;
      draw(figure, PAPER_WIDTH);
    }
  });
  addEventListener("afterprint", () => {
    if (choice) applyChoice();
    setTheme(themeOnScreen);
  });
  document.getElementById("print").addEventListener("click", () => print());

  // ---- Mark the section that is being read in the table of contents

  const links = new Map([...document.querySelectorAll(".contents a")].map((link) => [link.hash.slice(1), link]));
  const reading = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      links.forEach((link) => link.removeAttribute("aria-current"));
      links.get(target.id)?.setAttribute("aria-current", "true");
    }
  }, { rootMargin: "-20% 0px -70%" });
  document.querySelectorAll("main section").forEach((section) => reading.observe(section));

  drawMissing();
  for (let figure = missing(); figure?.getBoundingClientRect().top < innerHeight; figure = missing()) draw(figure);

  performance.mark("report-ready");
}
