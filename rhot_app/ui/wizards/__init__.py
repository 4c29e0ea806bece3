"""The wizards: one window for all, and how to add one.

A wizard is a row of steps. Each step is two small classes:

* a model (`models.step.Step`, Qt-free, in ``steps/NAME_steps.py``): its state, the sentence that says what to do now,
  the bars, the verdict, whether it is done. `see` looks at pictures in a worker's thread and changes nothing;
  everything else is called in the window's thread and must be quick. Mathematics and judgement are in
  `rhot_app.calibration`.
* a page (`framework.page.Page`): the widgets at the right, and what takes the middle when live pictures do not. A page
  hands what a person does to its model and emits `changed`; a step without controls needs no class: ``Page(step)``.

To add one:

1. add a record to `rhot_app.calibration.registry`, and a section with its title to docs/guide/calibration.md, at the
   same place. The Calibrate menu, `rhot calibrate` and the history follow;
2. write the steps in ``steps/NAME_steps.py``, and test them without Qt: call `take` with what `see` returns, look at
   `view`. Long work is a `models.step.SolveStep`;
3. write ``make_wizard(context) -> Definition`` in ``NAME.py``, with the pages that are its own; the last page is a
   `framework.page.AcceptPage` on a `models.step.AcceptStep`. The function given to that returns a
   `rhot_app.ui.models.proposal.Proposal`: rows before and after, the verdict, and the changes (`RigChange`,
   `NodeChange`) that put it into force and take it back. Nothing else writes anything;
4. test it as a person would: in tests/ui/wizards, `Hands` clicks and `FakeRigAsker` draws pictures;
   tests/ui/wizards/test_recipe.py is an example. Run it once in tests/ui/wizards/on_simulated_rig. ``hands.keep(NAME)``
   takes a page's picture for the guide: open it.

The work of a `SolveStep` is a `models.step.Task`: a module function without Qt with a `progress` argument. It runs in a
process of its own (`rhot_app.ui.backend.solver`) with remaining time and cancel, while pictures stay live. What
`context.connect()` gives is used in workers only: `Job`, `Proposal.use`, `Definition.put_back`.

Live pictures (`rhot_app.ui.backend.feed`) are the nodes' stills in full size; `framework.work.PictureWorker` calls
`see` with the newest of all cameras. What a step draws over them is in `models.drawing`, in px of the full frame.
"""
