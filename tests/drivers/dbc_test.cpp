#include "drivers/can/dbc.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "drivers/can/signal_map.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

CanFrame Frame(const std::string& id_hex, bool extended, const std::string& data_hex) {
  CanFrame frame;
  frame.id = static_cast<std::uint32_t>(std::stoul(id_hex, nullptr, 16));
  frame.extended = extended;
  frame.SetData(FromHex(data_hex));
  frame.fd = frame.length > 8;
  return frame;
}

std::map<std::string, double> Values(const Dbc::Decoded& decoded) {
  std::map<std::string, double> values;
  for (const Dbc::Value& value : decoded.values) values[value.signal->name] = value.physical;
  return values;
}

double Tolerance(double value) { return 1e-12 * std::max(1.0, std::abs(value)); }

TEST(Dbc, DecodesTheGoldenFramesAsTwoOtherReadersDo) {
  SKIP_WITHOUT(Shared("vectors/can"));
  const Dbc dbc = Dbc::Load(Shared("vectors/can/test_signals.dbc"));
  int compared = 0;
  for (const auto& vector : ReadJson(Shared("vectors/can/signal_vectors.json"))) {
    const auto decoded = dbc.Decode(Frame(vector["can_id"], vector["extended"], vector["data"]));
    ASSERT_TRUE(decoded) << vector["message"];
    EXPECT_EQ(decoded->message->name, vector["message"]);
    EXPECT_TRUE(decoded->missing.empty());
    const std::map<std::string, double> values = Values(*decoded);
    EXPECT_EQ(values.size(), vector["signals"].size()) << vector["message"];
    for (const auto& signal : vector["signals"]) {
      const std::string name = signal["signal"];
      ASSERT_TRUE(values.contains(name)) << name;
      const double expected = signal["physical"];
      EXPECT_NEAR(values.at(name), expected, Tolerance(expected)) << vector["message"] << name;
      ++compared;
    }
  }
  EXPECT_GT(compared, 80);
}

TEST(Dbc, EncodesTheGoldenFramesToTheSameBytes) {
  SKIP_WITHOUT(Shared("vectors/can"));
  const Dbc dbc = Dbc::Load(Shared("vectors/can/test_signals.dbc"));
  int same = 0;
  for (const auto& vector : ReadJson(Shared("vectors/can/signal_vectors.json"))) {
    std::map<std::string, double> values;
    bool exact = true;  // 64-bit raw values beyond 2^53 do not fit a double
    for (const auto& signal : vector["signals"]) {
      values[signal["signal"]] = signal["physical"];
      exact = exact && std::abs(signal["raw"].get<double>()) < 9007199254740992.0;
    }
    if (!exact) continue;
    const CanFrame golden = Frame(vector["can_id"], vector["extended"], vector["data"]);
    const CanFrame encoded = dbc.Encode(vector["message"], values);
    // Golden frames may have bits set that no signal has: compare through the signals.
    EXPECT_EQ(Values(*dbc.Decode(encoded)), Values(*dbc.Decode(golden))) << vector["message"];
    EXPECT_EQ(encoded.length, golden.length);
    EXPECT_EQ(encoded.extended, golden.extended);
    same += encoded.bytes == golden.bytes ? 1 : 0;
  }
  EXPECT_GT(same, 20);
}

TEST(Dbc, WorkedExamplesOfBothByteOrdersCrossAByte) {
  const Dbc dbc = Dbc::Parse(
      "BO_ 1 M: 8 X\n SG_ I : 20|12@1- (0.25,-10) [0|0] \"\" X\n"
      "BO_ 2 N: 8 X\n SG_ S : 53|10@0- (0.2,5) [0|0] \"\" X\n",
      "t.dbc");
  EXPECT_DOUBLE_EQ(dbc.Decode(Frame("1", false, "0000D0B200000000"))->values[0].physical, -318.75);
  EXPECT_DOUBLE_EQ(dbc.Decode(Frame("2", false, "0000000000002D30"))->values[0].physical, -55.2);
}

TEST(Dbc, ReadsFilesOfTwoVendors) {
  SKIP_WITHOUT(Shared("vectors/can/third_party"));
  const Dbc sbg = Dbc::Load(Shared("vectors/can/third_party/sbgCan.dbc"));
  EXPECT_GT(sbg.messages().size(), 40u);
  const Dbc xsens = Dbc::Load(Shared("vectors/can/third_party/xsens.dbc"));
  EXPECT_GT(xsens.messages().size(), 20u);
  int compared = 0;
  for (const auto& vector : ReadJson(Shared("vectors/can/xsens_mti600_vectors.json"))) {
    const auto decoded = xsens.Decode(Frame(vector["can_id"], false, vector["data"]));
    if (!decoded) continue;
    const std::map<std::string, double> values = Values(*decoded);
    for (const auto& [name, expected] : vector["signals"].items()) {
      // That file marks the pressure signed, which it is not, and takes 32768 for 32767.
      if (!values.contains(name) || name == "Pressure") continue;
      EXPECT_NEAR(values.at(name), expected.get<double>(), 4e-5 * std::abs(values.at(name)))
          << vector["name"] << "." << name;
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
}

TEST(Dbc, OurEcanFileReadsEveryGoldenFrameAsTheVendorsDoes) {
  SKIP_WITHOUT(Shared("vectors/can"));
  const Dbc ours = Dbc::Load(ConfigFile("sbg_ecan.dbc"));
  const Dbc vendors = Dbc::Load(Shared("vectors/can/third_party/sbgCan.dbc"));
  for (const auto& vector : ReadJson(Shared("vectors/can/sbg_ecan_vectors.json"))) {
    const CanFrame frame = Frame(vector["can_id"], false, vector["data"]);
    const auto decoded = ours.Decode(frame);
    ASSERT_TRUE(decoded) << vector["name"];
    EXPECT_EQ(decoded->message->name, vector["name"]);
    const std::map<std::string, double> values = Values(*decoded);
    // One of ours is a bit of the vendor's solution word.
    const std::size_t ours_alone = values.contains("SOLUTION_ALIGNED") ? 1 : 0;
    ASSERT_EQ(values.size() - ours_alone, vector["signals"].size()) << vector["name"];
    const auto of_vendor = vendors.Decode(frame);
    ASSERT_TRUE(of_vendor) << vector["name"];
    for (const auto& [name, expected] : vector["signals"].items()) {
      EXPECT_NEAR(values.at(name), expected.get<double>(), Tolerance(expected)) << name;
      EXPECT_NEAR(Values(*of_vendor).at(name), values.at(name), 1e-9) << name;
    }
  }
}

TEST(Dbc, ASignalBeyondTheReceivedBytesIsMissingNotZero) {
  const Dbc dbc = Dbc::Load(ConfigFile("sbg_ecan.dbc"));
  const auto decoded = dbc.Decode(Frame("121", false, "010006FF2B"));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->values.size(), 2u);
  ASSERT_EQ(decoded->missing.size(), 1u);
  EXPECT_EQ(decoded->missing[0]->name, "ACCEL_Z");
}

TEST(Dbc, RemoteAndErrorFramesCarryNoSignals) {
  const Dbc dbc = Dbc::Load(ConfigFile("sbg_ecan.dbc"));
  CanFrame frame = Frame("121", false, "010006FF2BFC");
  frame.remote = true;
  EXPECT_FALSE(dbc.Decode(frame));
  frame.remote = false;
  frame.error = true;
  EXPECT_FALSE(dbc.Decode(frame));
}

std::string ErrorOf(const std::string& text) {
  try {
    Dbc::Parse(text, "bad.dbc");
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "no error";
}

TEST(Dbc, ErrorsNameFileLineAndReason) {
  const std::string head = "VERSION \"\"\n\nBO_ 1 M: 8 X\n";
  EXPECT_THAT(ErrorOf(head + " SG_ A : 60|8@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("bad.dbc:4: signal A lies outside its message"));
  EXPECT_THAT(ErrorOf(head + " SG_ A : x|8@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("bad.dbc:4: expected the start bit"));
  EXPECT_THAT(ErrorOf(head + " SG_ A : 0|8@2+ (1,0) [0|0] \"\" X\n"), HasSubstr("byte order"));
  EXPECT_THAT(ErrorOf(head + " SG_ A : 0|8@1+ (0,0) [0|0] \"\" X\n"),
              HasSubstr("factor of A is 0"));
  EXPECT_THAT(ErrorOf(head + " SG_ A m1 : 0|8@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("has no switch"));
  EXPECT_THAT(ErrorOf(head + "\nBO_ 1 N: 8 X\n"),
              HasSubstr("bad.dbc:5: message id 1 stands twice"));
  EXPECT_THAT(ErrorOf("BO_ 1 M: 99 X\n"), HasSubstr("bad.dbc:1: expected the message's length"));
  EXPECT_THAT(ErrorOf("CM_ \"never ends"), HasSubstr("bad.dbc:1: text without an end"));
  EXPECT_THAT(ErrorOf("CM_ \"a\"\n\n"), HasSubstr("bad.dbc:1: statement without ';'"));
  EXPECT_THAT(ErrorOf(head + "SIG_VALTYPE_ 1 Z : 1;\n"), HasSubstr("bad.dbc:4: no such signal: Z"));
  EXPECT_THAT(ErrorOf("\n= 3;\n"), HasSubstr("bad.dbc:2: expected a statement"));
}

TEST(Dbc, AMissingFileIsOneLine) {
  EXPECT_THROW(Dbc::Load("/nowhere/at.dbc"), std::runtime_error);
  EXPECT_THROW(Dbc::Load("/"), std::runtime_error);
}

TEST(Dbc, EveryTruncationOfAFileIsReadOrRefusedWithoutHarm) {
  const std::string text = TextOf(ConfigFile("seastitch_dvl.dbc"));
  int refused = 0;
  for (std::size_t n = 0; n < text.size(); n += 3) {
    try {
      Dbc::Parse(text.substr(0, n), "cut.dbc");
    } catch (const std::runtime_error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

// S switches T (a switch itself) at 0 and U at 1 and 5 to 7; T switches V at 2 and W at 3 to 4.
constexpr char kNested[] =
    "BO_ 1 M: 8 X\n SG_ S M : 0|8@1+ (1,0) [0|0] \"\" X\n"
    " SG_ T m0M : 8|8@1+ (1,0) [0|0] \"\" X\n SG_ U m1 : 16|8@1+ (1,0) [0|0] \"\" X\n"
    " SG_ V m2 : 24|8@1+ (1,0) [0|0] \"\" X\n SG_ W m3 : 32|8@1+ (1,0) [0|0] \"\" X\n"
    " SG_ A : 40|8@1+ (1,0) [0|0] \"\" X\n"
    "SG_MUL_VAL_ 1 T S 0-0;\nSG_MUL_VAL_ 1 U S 1-1, 5-7;\n"
    "SG_MUL_VAL_ 1 V T 2-2;\nSG_MUL_VAL_ 1 W T 3 - 4;\n";

// Expected: what Debian's canmatrix finds in these frames by this file.
TEST(Dbc, NestedAndRangedMultiplexing) {
  const Dbc dbc = Dbc::Parse(kNested, "t.dbc");
  const auto names_in = [&dbc](const std::string& data) {
    std::string names;
    for (const auto& [name, value] : Values(*dbc.Decode(Frame("1", false, data)))) names += name;
    return names;
  };
  EXPECT_EQ(names_in("0000112233445566"), "AST");
  EXPECT_EQ(names_in("0002112233445566"), "ASTV");
  EXPECT_EQ(names_in("0004112233445566"), "ASTW");
  EXPECT_EQ(names_in("0102112233445566"), "ASU");
  EXPECT_EQ(names_in("0602112233445566"), "ASU");
  EXPECT_EQ(names_in("0802112233445566"), "AS");
  // Where a switch is beyond the received bytes, what it switches is missing.
  const auto cut = dbc.Decode(Frame("1", false, "00"));
  EXPECT_EQ(cut->values.size(), 1u);
  EXPECT_EQ(cut->missing.size(), 4u);  // T, V, W, A; U is not there
}

TEST(Dbc, EncodingANestedSignalSetsTheSwitchesThatAreNotNamed) {
  const Dbc dbc = Dbc::Parse(kNested, "t.dbc");
  const auto bytes = [&dbc](const std::map<std::string, double>& values) {
    const CanFrame frame = dbc.Encode("M", values);
    return std::vector<std::uint8_t>(frame.bytes.begin(), frame.bytes.begin() + 5);
  };
  EXPECT_EQ(bytes({{"W", 9.0}}), (std::vector<std::uint8_t>{0, 3, 0, 0, 9}));
  EXPECT_EQ(bytes({{"W", 9.0}, {"T", 4.0}}), (std::vector<std::uint8_t>{0, 4, 0, 0, 9}));
  EXPECT_EQ(bytes({{"U", 9.0}}), (std::vector<std::uint8_t>{1, 0, 9, 0, 0}));
  EXPECT_EQ(bytes({{"U", 9.0}, {"S", 7.0}}), (std::vector<std::uint8_t>{7, 0, 9, 0, 0}));
}

TEST(Dbc, ErrorsOfSwitchesNameLineAndReason) {
  const std::string head = "BO_ 1 M: 8 X\n SG_ S M : 0|8@1+ (1,0) [0|0] \"\" X\n";
  const auto signal = [](const std::string& name_and_mark) {
    return " SG_ " + name_and_mark + " : 8|8@1+ (1,0) [0|0] \"\" X\n";
  };
  EXPECT_THAT(ErrorOf(head + signal("T M") + signal("U m1")),
              HasSubstr("bad.dbc:4: message M has two switches"));
  EXPECT_THAT(ErrorOf(head + signal("U m1") + "SG_MUL_VAL_ 1 U Q 1-1;\n"),
              HasSubstr("bad.dbc:3: signal U: no such switch: Q"));
  EXPECT_THAT(ErrorOf(head + signal("U m1M") + "SG_MUL_VAL_ 1 U U 1-1;\n"),
              HasSubstr("bad.dbc:3: signal U is switched by itself"));
  EXPECT_THAT(ErrorOf(head + "SG_MUL_VAL_ 1 Z S 1-1;\n"), HasSubstr("no such signal: Z"));
  EXPECT_THAT(ErrorOf(head + "SG_MUL_VAL_ 1 S S 1;\n"), HasSubstr("expected '-'"));
  EXPECT_THAT(ErrorOf(head + "SG_MUL_VAL_ 1 S S 2-1;\n"),
              HasSubstr("bad.dbc:3: a range that ends before it begins"));
  EXPECT_THAT(ErrorOf(head + signal("U x1")), HasSubstr("expected M, m<number> or ':'"));
}

TEST(Dbc, ValueTextsAndUnitsOfWindowsFiles) {
  const Dbc dbc = Dbc::Parse(
      "BO_ 1 M: 8 X\n SG_ S : 0|8@1- (0.5,0) [0|0] \"\xB0/s\" X\n"
      "VAL_TABLE_ Modes 0 \"off\" 1 \"on\" ;\n"
      "VAL_ 1 S 0 \"off\" -1 \"20 \x80 \xB5\" 3 \"\xC3\xA4 is UTF-8\" ;\n"
      "VAL_ Environment 0 \"nothing\" ;\n",
      "t.dbc");
  const DbcSignal& signal = dbc.messages()[0].signals[0];
  EXPECT_EQ(signal.unit, "\u00B0/s");
  EXPECT_EQ(signal.ValueText(0), "off");
  EXPECT_EQ(signal.ValueText(0xFF), "20 \u20AC \u00B5");
  EXPECT_EQ(signal.ValueText(3), "\u00E4 is UTF-8");
  EXPECT_EQ(signal.ValueText(4), "");
  const std::string head = "BO_ 1 M: 8 X\n SG_ S : 0|8@1- (1,0) [0|0] \"\" X\n";
  EXPECT_THAT(ErrorOf(head + "VAL_ 1 T 0 \"a\" ;\n"), HasSubstr("bad.dbc:3: no such signal: T"));
  EXPECT_THAT(ErrorOf(head + "VAL_ 1 S 0 1 ;\n"),
              HasSubstr("bad.dbc:3: expected the text of the value"));
  EXPECT_THAT(ErrorOf(head + "VAL_TABLE_ T 0 \"a\"\nBO_ 2 N: 8 X\n"), HasSubstr("expected ';'"));
}

TEST(Dbc, ValueTextsOfTheGoldenFile) {
  SKIP_WITHOUT(Shared("vectors/can"));
  const Dbc dbc = Dbc::Load(Shared("vectors/can/test_signals.dbc"));
  EXPECT_EQ(dbc.Find("Muxed")->Find("Mode")->ValueText(1), "pressure");
}

TEST(Dbc, EncodeRefusesWhatASignalCannotHold) {
  const Dbc dbc = Dbc::Load(ConfigFile("seastitch_dvl.dbc"));
  EXPECT_THROW(dbc.Encode("DVL_VELOCITY", {{"VELOCITY_X", 11.0}}), std::runtime_error);
  EXPECT_THROW(dbc.Encode("DVL_VELOCITY", {{"VELOCITY_X", NAN}}), std::runtime_error);
  EXPECT_THROW(dbc.Encode("DVL_VELOCITY", {{"VELOCITY_W", 1.0}}), std::runtime_error);
  EXPECT_THROW(dbc.Encode("DVL_ANYTHING", {}), std::runtime_error);
}

DbcSignal AnySignal(int length_limit) {
  DbcSignal signal;
  signal.motorola = *rc::gen::arbitrary<bool>();
  signal.length = *rc::gen::inRange(1, length_limit + 1);
  signal.kind = *rc::gen::element(DbcSignal::Kind::kUnsigned, DbcSignal::Kind::kSigned);
  // A Motorola walk from the top bit of byte b takes at most 64 bits: 8 bytes on.
  signal.start_bit = *rc::gen::inRange(0, 8 * 48);
  return signal;
}

TEST(DbcSignal, BitsComeBackAsTheyWerePut) {
  EXPECT_TRUE(rc::check([] {
    const DbcSignal signal = AnySignal(64);
    CanFrame frame;
    frame.fd = true;
    frame.length = 64;
    for (std::uint8_t& byte : frame.bytes) byte = *rc::gen::arbitrary<std::uint8_t>();
    const CanFrame before = frame;
    const std::uint64_t mask = signal.length == 64 ? ~0ULL : (1ULL << signal.length) - 1;
    const std::uint64_t bits = *rc::gen::arbitrary<std::uint64_t>() & mask;
    signal.Put(bits, &frame);
    RC_ASSERT(signal.Bits(frame.data()) == bits);
    // Nothing else moved.
    signal.Put(*signal.Bits(before.data()), &frame);
    RC_ASSERT(frame == before);
  }));
}

TEST(DbcSignal, PhysicalValuesComeBackWithinHalfAStep) {
  EXPECT_TRUE(rc::check([] {
    DbcSignal signal = AnySignal(50);
    signal.factor = 0.001 * *rc::gen::inRange(1, 1000);
    signal.offset = *rc::gen::inRange(-100, 100);
    const double reach = signal.factor * std::ldexp(1.0, signal.length - 1);
    const double physical =
        signal.offset + reach * (*rc::gen::inRange(0, 1000) / 1000.0 -
                                 (signal.kind == DbcSignal::Kind::kSigned ? 0.5 : 0.0));
    const std::optional<std::uint64_t> bits = signal.RawBits(physical);
    RC_ASSERT(bits.has_value());
    RC_ASSERT(std::abs(signal.Physical(*bits) - physical) <= 0.501 * signal.factor + 1e-9 * reach);
  }));
}

TEST(DbcSignal, SaturatesAtTheEndsOfItsRange) {
  DbcSignal signal;
  signal.length = 12;
  signal.kind = DbcSignal::Kind::kSigned;
  signal.factor = 0.5;
  EXPECT_EQ(signal.Physical(signal.SaturatedBits(1e9)), 1023.5);
  EXPECT_EQ(signal.Physical(signal.SaturatedBits(-1e9)), -1024.0);
  EXPECT_EQ(signal.Physical(signal.SaturatedBits(NAN)), 0.0);
  signal.kind = DbcSignal::Kind::kUnsigned;
  EXPECT_EQ(signal.Physical(signal.SaturatedBits(1e9)), 2047.5);
  EXPECT_EQ(signal.Physical(signal.SaturatedBits(-3.0)), 0.0);
}

TEST(SignalMap, TurnsAxesAndUnitsByAFactor) {
  const Dbc dbc = Dbc::Load(ConfigFile("sbg_ecan.dbc"));
  SignalMap map;
  map.Assign(dbc, 0, "IMU_GYRO.GYRO_Z * -57.5");
  const auto reading = map.Read(Frame("122", false, "00000000E803"));
  ASSERT_TRUE(reading);
  EXPECT_DOUBLE_EQ(reading->values.value[0], -57.5);
  EXPECT_DOUBLE_EQ(map.Resolution(0), 0.0575);
  EXPECT_EQ(map.Write(reading->values).at(0).bytes, Frame("122", false, "00000000E803").bytes);
}

TEST(SignalMap, RefusesWhatTheFileDoesNotHave) {
  const Dbc dbc = Dbc::Load(ConfigFile("sbg_ecan.dbc"));
  SignalMap map;
  for (const char* const text : {"IMU_GYRO.GYRO_Q",
                                 "GYRO.GYRO_X",
                                 "IMU_GYRO",
                                 "IMU_GYRO.GYRO_X * fast",
                                 "",
                                 "IMU_GYRO.GYRO_X * 0",
                                 "IMU_GYRO.GYRO_X * inf"})
    EXPECT_THROW(map.Assign(dbc, 0, text), std::runtime_error) << text;
}

TEST(SignalMap, AMultiplexedSignalIsThereOnlyUnderItsMode) {
  const Dbc dbc = Dbc::Parse(
      "BO_ 1 M: 8 X\n SG_ S M : 0|8@1+ (1,0) [0|0] \"\" X\n"
      " SG_ A m3 : 8|8@1+ (1,0) [0|0] \"\" X\n SG_ B m4 : 8|8@1+ (1,0) [0|0] \"\" X\n",
      "t.dbc");
  SignalMap map;
  map.Assign(dbc, 5, "M.A");
  map.Assign(dbc, 6, "M.B");
  const auto reading = map.Read(Frame("1", false, "0407"));
  ASSERT_TRUE(reading);
  EXPECT_TRUE(reading->complete);
  EXPECT_FALSE(reading->values.present.test(5));
  EXPECT_EQ(reading->values.value[6], 7.0);
  FieldValues both;
  both.Set(5, 1.0);
  both.Set(6, 2.0);
  EXPECT_EQ(map.Write(both).size(), 2u);
}

TEST(SignalMap, AFloatThatIsNotFiniteMakesTheFrameIncomplete) {
  const Dbc dbc = Dbc::Parse(
      "BO_ 1 M: 4 X\n SG_ F : 0|32@1- (1,0) [0|0] \"\" X\nSIG_VALTYPE_ 1 F : 1;\n", "t.dbc");
  SignalMap map;
  map.Assign(dbc, 0, "M.F");
  EXPECT_FALSE(map.Read(Frame("1", false, "0000C07F"))->complete);  // NaN
  EXPECT_FALSE(map.Read(Frame("1", false, "0000807F"))->complete);  // infinity
  EXPECT_TRUE(map.Read(Frame("1", false, "0000803F"))->complete);
}

}  // namespace
}  // namespace seastitch
