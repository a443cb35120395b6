# SPDX-License-Identifier: Apache-2.0
"""The planner's life cycle as `ros2 lifecycle` drives it, over its services."""

from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from planner_talk import FREE, GOAL, LOCKSTEP, Talk, fields, goal, mode, odom, sectors
from ros_graph import Graph
from std_srvs.srv import Trigger

from mfba_planner.core.types import Mode
from mfba_planner.recording.from_messages import decision as read_decision
from mfba_planner.ros.interface import topics
from mfba_planner.ros.nodes.planner import PlannerNode

OUTPUTS = (topics.GOAL_STEP, topics.CMD_VEL, topics.PLAN, topics.DECISION, topics.MARKERS)
NAMES = {
    "configure": Transition.TRANSITION_CONFIGURE,
    "activate": Transition.TRANSITION_ACTIVATE,
    "deactivate": Transition.TRANSITION_DEACTIVATE,
    "cleanup": Transition.TRANSITION_CLEANUP,
}


def state(graph: Graph) -> str:
    label: str = graph.call(GetState, "planner/get_state").current_state.label
    return label


def change(graph: Graph, name: str) -> bool:
    request = ChangeState.Request(transition=Transition(id=NAMES.get(name, 0), label=name))
    done: bool = graph.call(ChangeState, "planner/change_state", request).success
    return done


def offers(graph: Graph) -> set[str]:
    return {t.name for t in OUTPUTS if graph.probe.count_publishers(t.name)}


def test_by_default_it_is_active_at_once(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    assert state(graph) == "active"
    assert mode(talk.answer(odom(1), sectors(1))) is Mode.PATH_GENERATION


def test_without_autostart_it_is_led_through_its_states(graph: Graph) -> None:
    node = graph.start(PlannerNode, {"autostart": False})
    heard = graph.hear(topics.DIAGNOSTICS)
    assert (state(graph), node.missing()) == ("unconfigured", "unconfigured, not active")
    assert not offers(graph)
    assert not change(graph, "activate"), "not before it is configured"
    assert change(graph, "configure")
    assert state(graph) == "inactive"
    assert offers(graph) == {topic.name for topic in OUTPUTS}
    ready = graph.call(Trigger, "planner/ready")
    assert (ready.success, ready.message) == (False, "inactive, not active")
    assert change(graph, "activate")
    assert graph.call(Trigger, "planner/ready").success
    graph.until(lambda: "active" in said(heard))
    assert change(graph, "deactivate")
    assert change(graph, "cleanup")
    graph.until(lambda: not offers(graph))
    assert state(graph) == "unconfigured"


def said(heard: list[Any]) -> list[str]:
    return [v.value for message in heard for v in message.status[1].values if v.key == "state"]


def test_deactivated_it_commands_rest_once_and_nothing_more(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    talk.answer(odom(1), sectors(1))
    assert talk.velocity != (0.0, 0.0)
    assert change(graph, "deactivate")
    graph.settle()
    assert len(talk.cmd_vel) == 2
    assert talk.velocity == (0.0, 0.0)
    place = talk.steps[-1].pose.position
    assert (place.x, place.y) == (0.0, 0.0), "where the robot is"
    silent = [len(x) for x in (talk.cmd_vel, talk.steps, talk.plans, talk.decisions)]
    for stamp in (2, 3):
        talk.odom.publish(odom(stamp))
        talk.sectors.publish(sectors(stamp))
    graph.settle()
    assert [len(x) for x in (talk.cmd_vel, talk.steps, talk.plans, talk.decisions)] == silent


@pytest.mark.parametrize("lockstep", [True, False])
def test_activated_again_it_goes_on_to_its_goal(graph: Graph, lockstep: bool) -> None:
    talk = Talk(graph, {**LOCKSTEP, "lockstep": lockstep, "input_timeout_s": 60.0})
    talk.odom.publish(odom(1))
    graph.settle()
    talk.sectors.publish(sectors(1))
    graph.until(lambda: len(talk.decisions) == 1)
    assert change(graph, "deactivate")
    assert change(graph, "activate")
    talk.odom.publish(odom(2, 1.0))
    graph.settle()
    talk.sectors.publish(sectors(2))
    graph.until(lambda: len(talk.decisions) == 2)
    told = read_decision(talk.decisions[-1], FREE)
    assert (told.mode, told.goal) == (Mode.PATH_GENERATION, GOAL)


def test_a_goal_given_while_it_is_inactive_is_kept(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP, at=None)
    assert change(graph, "deactivate")
    talk.goal.publish(goal(2.0, 2.0))
    graph.settle()
    assert change(graph, "activate")
    assert fields(talk.answer(odom(1), sectors(1)))["goal"] == "2.0,2.0"


def test_cleaned_up_it_has_forgotten_its_goal_and_hears_the_latched_one(graph: Graph) -> None:
    talk = Talk(graph, LOCKSTEP)
    for name in ("deactivate", "cleanup"):
        assert change(graph, name)
    assert talk.node.goals.goal_queue.goal is None
    for name in ("configure", "activate"):
        assert change(graph, name)
    graph.until(lambda: talk.node.goals.goal_queue.goal == GOAL)
    assert mode(talk.answer(odom(1), sectors(1))) is Mode.PATH_GENERATION


@pytest.mark.parametrize("path", [[], ["deactivate"], ["deactivate", "cleanup"]])
def test_shut_down_from_anywhere_the_process_ends(graph: Graph, path: list[str]) -> None:
    talk = Talk(graph, LOCKSTEP)
    for name in path:
        assert change(graph, name)
    assert change(graph, "shutdown")
    assert state(graph) == "finalized"
    assert talk.node.finished
    assert offers(graph) == set()


def test_in_one_process_nobody_is_offered_its_life_cycle(graph: Graph) -> None:
    node = graph.start(PlannerNode, LOCKSTEP, start_parameter_services=False)
    assert node.is_active
    offered = dict(graph.probe.get_service_names_and_types())
    assert "/planner/change_state" not in offered
