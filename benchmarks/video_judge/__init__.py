"""Judgement of simulated videos by a vision-language model, validated on videos with known faults.

A video is how one scene moves under one condition. The reference is our own run; a control is the reference with one
known fault; a method is another way to simulate the same scene. What the judge says of a law of physics counts only
where its answers tell the controls of that law from the reference. Read in order: subquestions, video_motion,
edited_controls, camera_staging, judge_pictures, video_question, detectability, judge_scenes.
"""
