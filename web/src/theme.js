// Light or dark: the book's switch (pydata-sphinx-theme), JupyterLab's, or else the system's.

export const THEMES = {
  light: { floor: "#eceff3", line: "#b4bdc9", shadow: 0.26, sky: 1.5, rim: 0.8, outline: "#1b2026" },
  dark: { floor: "#1d232b", line: "#414c59", shadow: 0.5, sky: 1.0, rim: 1.8, outline: "#05070a" },
};

const system = globalThis.matchMedia?.("(prefers-color-scheme: dark)");

export function currentTheme() {
  const book = document.documentElement.dataset.theme;
  if (book === "dark" || book === "light") return book;
  const lab = document.body.dataset.jpThemeLight;
  if (lab !== undefined) return lab === "false" ? "dark" : "light";
  return system?.matches ? "dark" : "light";
}

/** Call back with the theme's name at every change; returns a function that stops it. */
export function watchTheme(callback) {
  const tell = () => callback(currentTheme());
  const observer = new MutationObserver(tell);
  observer.observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
  observer.observe(document.body, { attributes: true, attributeFilter: ["data-jp-theme-light"] });
  system?.addEventListener("change", tell);
  return () => {
    observer.disconnect();
    system?.removeEventListener("change", tell);
  };
}
