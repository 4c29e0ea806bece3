"""The wizards: one window for all, and how to add one.

A wizard is a row of steps. Each step is two small classes:

* a model (`models.step.Step`, Qt-free, in ``models/``): its state, the sentence that says what to do now, the bars, the
  verdict, whether it is done. `see` looks at pictures in a worker's thread and changes nothing; everything else is
  called in the window's thread and must be quick. Mathematics and judgement are in `rhot_app.calibration`.
* a page (`page.Page`): the widgets at the right, and what takes the middle when live pictures do not. A page hands what
  a person does to its model and emits `changed`; a step without controls needs no class of its own: ``Page(step)``.

To add one:

1. write the steps in ``models/NAME.py``, and test them there without Qt: feed `take`, look at `view`;
2. write the pages and ``make_plan(kit) -> Plan`` in ``NAME.py``; the last page is a `framework.page.AcceptPage` on an
   `AcceptStep` whose function gives a `models.proposal.Proposal`: rows before and after, the verdict, and
   the changes (`RigChange`, `NodeChange`) that put it into force and take it back. Nothing else writes anything;
3. add a record to `rhot_app/calibration/registry.py`; the Calibrate menu, `rhot calibrate` and the history follow;
4. test it as a person would: tests/ui/wizards, `Hands` clicks, `FakeRigAsker` draws pictures, and once on the real
   simulated rig; add its pages to tests/ui/wizards/test_wizard_screenshots.py, open the pictures, explain them in
   docs/guide/calibration.md.

Long work is a `models.step.Task`: a module function without Qt with a `progress` argument, run in a process of its own
(`solver`) with remaining time and cancel, while pictures stay live. What `kit.connect()` gives is used in workers only:
`Job`, `Proposal.use`, `Plan.put_back`.

Live pictures (`feed`) are the nodes' stills in full size; `looker` runs `see` on the newest of all cameras. What a step
draws over them is `models.drawing`, in px of the full frame.
"""
