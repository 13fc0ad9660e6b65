"""Style of the page: that of viser, but dark or light enough to be read (WCAG 2.1 AA: text 4.5 to 1, edges 3 to 1).

What is said on the drawing lets the pointer through, for a click on it means what lies under it; its cross closes it.
"""

from __future__ import annotations

PANEL_STYLE = """<style>
:root[data-mantine-color-scheme] { --mantine-color-dimmed: #545b62; --mantine-primary-color-filled: #1864ab;
  --mantine-primary-color-filled-hover: #14538f; --mantine-color-blue-filled: #1864ab; --mantine-color-blue-filled-hover: #14538f;
  --mantine-color-blue-outline: #1864ab; --mantine-color-blue-text: #1864ab; --mantine-color-placeholder: #5f666d }
:root[data-mantine-color-scheme="dark"] { --mantine-color-dimmed: #b4bac0; --mantine-color-blue-outline: #8cc4f8;
  --mantine-color-blue-text: #8cc4f8; --mantine-color-placeholder: #a9b0b6 }
[data-mantine-color-scheme="light"] [role="tab"][aria-selected="true"] span { color: #1864ab !important }
[data-mantine-color-scheme="dark"] [role="tab"][aria-selected="true"] span { color: #8cc4f8 !important }
[data-mantine-color-scheme="light"]
  :is(.multi-slider-mark-label, .mantine-Slider-markLabel, .mantine-Notification-description) { color: #545b62 !important }
[data-mantine-color-scheme="dark"]
  :is(.multi-slider-mark-label, .mantine-Slider-markLabel, .mantine-Notification-description) { color: #b4bac0 !important }
:is(input, textarea, canvas, [data-with-border] > [role="button"]):focus-visible {
  outline: 2px solid #1864ab !important; outline-offset: -2px }
[data-mantine-color-scheme="dark"] :is(input, textarea, canvas, [role="button"]):focus-visible { outline-color: #8cc4f8 !important }
.mantine-Notification-root { pointer-events: none !important }
.mantine-Notification-closeButton { pointer-events: auto }
:is(.mantine-Input-input, .mantine-Checkbox-input:not(:checked)) { border-color: #868e96 !important }
[data-mantine-color-scheme="dark"] .mantine-Checkbox-input:checked { border-color: #8cc4f8 !important }
div:has(> .studio-unseen), div:has(> .studio-unseen) + div { display: none }
.studio-head { padding: .3em .8em 0; line-height: 1.35; font-size: .95em }
.studio-head > [role="status"] { height: 2.7em; overflow-y: auto }
:has(> div > div > div > .studio-head) { overflow: visible !important }
div:has(> .studio-head), div:has(> .studio-head) + div + div, div:has(> .studio-head) + div + div + div,
  div:has(> .studio-head) + div + div + div + div {
  position: sticky !important; z-index: 20; background: var(--mantine-color-body); margin: 0 !important }
div:has(> .studio-head) { top: 0; height: 60px }
div:has(> .studio-head) + div + div { top: 60px; height: 16px }
div:has(> .studio-head) + div + div + div { top: 76px; height: 36px; padding: 0 var(--mantine-spacing-xs) }
div:has(> .studio-head) + div + div + div + div { top: 112px; height: 34px }
.mantine-ScrollArea-viewport { scroll-padding-top: 150px }
@media (max-height: 560px) { div:has(> .studio-head) ~ div { position: static !important } }
.studio-refused { font-size: .85em; line-height: 1.06 }
.studio-head > small { display: block; overflow: hidden; text-overflow: ellipsis; white-space: nowrap }
[data-hints-aside] .mantine-Tooltip-tooltip {
  left: auto !important; right: calc(100vw - var(--studio-panel) + 12px) !important; translate: 0 calc(50% + 1.1rem) }
[data-hints-aside] .mantine-Tooltip-arrow { display: none }
pre { white-space: pre-wrap !important; overflow-wrap: anywhere }
.mantine-ScrollArea-viewport { overflow-x: hidden !important }
.mantine-ScrollArea-viewport > div { padding-right: 7px }
.mantine-ScrollArea-viewport .mantine-ScrollArea-viewport > div { padding-right: 0 }
.mantine-ScrollArea-scrollbar[data-orientation="horizontal"] { display: none }
</style>"""
