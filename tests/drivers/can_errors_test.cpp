#include "drivers/can/can_errors.hpp"

#include <gtest/gtest.h>

namespace seastitch {
namespace {

CanFrame Error(std::uint32_t classes, std::uint8_t controller = 0) {
  CanFrame frame;
  frame.error = true;
  frame.id = classes;
  frame.length = 8;
  frame.bytes[1] = controller;
  return frame;
}

TEST(CanErrors, ARunOfTroubleIsToldAndCounted) {
  CanErrors errors;
  EXPECT_EQ(errors.trouble(), "");
  errors.Add(Error(0x004, 0x04));
  EXPECT_EQ(errors.trouble(), "controller counts many errors");
  errors.Add(Error(0x004, 0x20));
  EXPECT_EQ(errors.trouble(), "controller is error-passive");
  errors.Add(Error(0x040));
  EXPECT_EQ(errors.trouble(), "controller is bus-off");
  errors.Add(Error(0x100));
  EXPECT_EQ(errors.trouble(), "");
  const Counters expected = {{"can_error_frames", 4},
                             {"can_error_warning", 1},
                             {"can_error_passive", 1},
                             {"can_bus_off", 1},
                             {"can_restarted", 1}};
  EXPECT_EQ(errors.counters(), expected);
}

TEST(CanErrors, WhatHappensOnTheWireIsCountedButNoState) {
  CanErrors errors;
  errors.Add(Error(0x020));
  errors.Add(Error(0x088));
  errors.Add(Error(0x004, 0x01));
  EXPECT_EQ(errors.trouble(), "");
  EXPECT_EQ(errors.counters().at("can_no_ack"), 1);
  EXPECT_EQ(errors.counters().at("can_protocol_errors"), 1);
  EXPECT_EQ(errors.counters().at("can_controller_overflows"), 1);
}

TEST(CanErrors, DataEndBusOffButNotErrorPassive) {
  CanErrors errors;
  errors.Add(Error(0x040));
  errors.SeeData();
  EXPECT_EQ(errors.trouble(), "");
  errors.Add(Error(0x004, 0x10));
  errors.SeeData();
  EXPECT_EQ(errors.trouble(), "controller is error-passive");
  errors.Add(Error(0x004, 0x40));
  EXPECT_EQ(errors.trouble(), "");
}

TEST(CanErrors, AShortErrorFrameHasNoControllerStatus) {
  CanErrors errors;
  CanFrame frame = Error(0x004, 0x20);
  frame.length = 1;
  errors.Add(frame);
  EXPECT_EQ(errors.trouble(), "");
}

}  // namespace
}  // namespace seastitch
