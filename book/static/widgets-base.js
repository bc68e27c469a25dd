// Loaded between require.js and the widget manager, on pages that hold widgets.

// The manager looks for its icons below require.js's base, which would be the page's folder.
require.config({ baseUrl: new URL(".", document.currentScript.src).href });

// It speaks to MathJax 2; ours is 3. This listener comes before the manager's own.
addEventListener("load", () => {
  if (window.MathJax?.startup) MathJax.Hub = { Queue: ([, , node]) => MathJax.typesetPromise([node]) };
});
