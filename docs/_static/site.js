// Names of buttons and keyboard access that the theme lacks, line breaks of names, and the animation of the front page.

// The visible text of the search button is part of its name. Screens that hide the text keep the name.
function nameSearchButtons() {
  for (const button of document.querySelectorAll("button.search-button-field[aria-label]")) {
    button.setAttribute("aria-label", button.innerText.replace(/\s+/g, " ").trim() || "Search");
  }
}

// The form of the search has no button that sends it, except the key Enter.
function addSubmitButtons() {
  for (const form of document.querySelectorAll("form.bd-search")) {
    if (form.querySelector("[type=submit]")) continue;
    const button = Object.assign(document.createElement("button"), { type: "submit", textContent: "Search" });
    button.className = "visually-hidden-focusable";
    form.append(button);
  }
}

// Buttons of the navigation show the pages below a page.
function nameNavigation() {
  for (const summary of document.querySelectorAll("li.has-children > details > summary")) {
    const page = summary.closest("li").querySelector("a");
    if (page) summary.setAttribute("aria-label", `Pages of ${page.textContent.trim()}`);
  }
}

// Names of functions and classes in the narrow navigation: without "warpdyn.", and broken only between their words.
function breakNamesBetweenWords() {
  for (const link of document.querySelectorAll(".bd-sidebar-primary .toctree-l2 a")) {
    if (!link.textContent.startsWith("warpdyn.")) continue;
    const words = link.textContent.trim().slice("warpdyn.".length).split(/(?<=[._])|(?<=[a-z])(?=[A-Z])/);
    link.replaceChildren(...words.flatMap((word, i) => (i ? [document.createElement("wbr"), word] : [word])));
  }
}

// Equations wider than the screen scroll; the keyboard can scroll what has the focus.
function focusWideEquations() {
  for (const equation of document.querySelectorAll(".equation")) {
    if (equation.scrollWidth > equation.clientWidth) equation.setAttribute("tabindex", "0");
    else equation.removeAttribute("tabindex");
  }
}

// A still picture is shown until this function runs, and afterwards if the reader prefers reduced motion.
function startAnimations() {
  for (const figure of document.querySelectorAll(".front-animation")) {
    const [picture, button] = [figure.querySelector("img"), figure.querySelector("button")];
    const [still, moving] = [picture.getAttribute("src"), picture.dataset.moving];
    const reduced = window.matchMedia("(prefers-reduced-motion: reduce)");
    const play = (moves) => {
      picture.src = moves ? moving : still;
      button.textContent = moves ? "Pause the animation" : "Play the animation";
    };
    button.hidden = false;
    button.addEventListener("click", () => play(picture.getAttribute("src") === still));
    reduced.addEventListener("change", () => play(!reduced.matches));
    play(!reduced.matches);
  }
}

document.addEventListener("DOMContentLoaded", () => {
  nameSearchButtons();
  addSubmitButtons();
  nameNavigation();
  breakNamesBetweenWords();
  focusWideEquations();
  startAnimations();
});
window.addEventListener("resize", focusWideEquations);
